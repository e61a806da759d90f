// A private folder of Unix sockets between our own processes, and addresses in it that are short
// however long the folder's path is: a socket's path has at most 107 bytes, so it is reached
// through this process's own descriptor of the folder. Immutable; thread-safe.
#pragma once

#include <filesystem>
#include <string>

namespace color3d {

class SocketFolder {
 public:
  // Creates the folder when it is missing; nobody but its owner may enter it. Throws
  // Error{kFailedPrecondition} when that cannot be had.
  explicit SocketFolder(const std::filesystem::path& folder);
  ~SocketFolder();
  SocketFolder(const SocketFolder&) = delete;
  SocketFolder& operator=(const SocketFolder&) = delete;

  // gRPC address of the socket `name`, for this process and while this object lives.
  std::string Address(const std::string& name) const;
  // Removes what processes that were killed have left.
  void RemoveAll() const;

 private:
  std::filesystem::path folder_;
  int fd_ = -1;
};

}  // namespace color3d
