// A file descriptor that is closed at the end of its scope.
#pragma once

#include <unistd.h>

namespace color3d {

class FileDescriptor {
 public:
  // Negative: none, as system calls return it on failure.
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

}  // namespace color3d
