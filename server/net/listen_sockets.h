// Sockets that listen at an address: HOST:PORT or unix:PATH. Thread-safe but for Close().
#pragma once

#include <string>
#include <vector>

namespace color3d {

class ListenSockets {
 public:
  // HOST may be a name, which may have several addresses; port 0 is any free one; 0.0.0.0 and [::]
  // listen on IPv4 and IPv6. A Unix socket that a server left when it was killed is replaced.
  // Throws Error{kFailedPrecondition}, in one line with the remedy, when the address is in use, is
  // none of this machine, or is a path that is too long, no socket, or somebody else's.
  explicit ListenSockets(const std::string& address);
  ~ListenSockets();
  ListenSockets(const ListenSockets&) = delete;
  ListenSockets& operator=(const ListenSockets&) = delete;

  // Listens no more; a Unix socket of ours is removed. The destructor does it, too.
  void Close();
  // They do not block and are not handed on to other programs.
  const std::vector<int>& descriptors() const { return descriptors_; }
  // As it was given, with the port that was bound.
  const std::string& address() const { return address_; }
  bool is_unix() const { return !path_.empty(); }

 private:
  void ListenOnUnix();
  void ListenOnTcp();
  // On each address of the host. The port that was bound; 0 with the last error: none, or the port
  // is in use on one of them.
  int BindAll(const std::string& host, const std::string& port, bool both_families, int* error);

  std::string address_;
  std::string path_;         // of the Unix socket; empty: TCP
  unsigned long inode_ = 0;  // of the file there
  int lock_ = -1;            // of the path, against other servers
  std::vector<int> descriptors_;
};

}  // namespace color3d
