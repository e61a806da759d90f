// A private folder of Unix sockets between processes of the server. A socket path has at most 107
// bytes, so addresses go through this process's descriptor of the folder, which keeps them short.
// Immutable; thread-safe.
#pragma once

#include <filesystem>
#include <string>

namespace color3d {

// Socket on which a server answers its workers.
constexpr char kWorkerSocket[] = "workers";

class SocketFolder {
 public:
  // Creates the folder if it is missing, accessible by its owner only. Throws
  // Error{kFailedPrecondition} on failure.
  explicit SocketFolder(const std::filesystem::path& folder);
  ~SocketFolder();
  SocketFolder(const SocketFolder&) = delete;
  SocketFolder& operator=(const SocketFolder&) = delete;

  // Returns the gRPC address of the socket `name`, valid in this process while this object lives.
  std::string Address(const std::string& name) const;
  // Removes sockets left by killed processes.
  void RemoveAll() const;

 private:
  std::filesystem::path folder_;
  int fd_ = -1;
};

}  // namespace color3d
