// Listening sockets of an address: HOST:PORT or unix:PATH. Thread-safe except for Close().
#pragma once

#include <string>
#include <vector>

namespace color3d {

class ListenSockets {
 public:
  // HOST may be a name with several addresses; port 0 is any free port; 0.0.0.0 and [::] listen on
  // IPv4 and IPv6. The Unix socket of a killed server is replaced. Throws
  // Error{kFailedPrecondition} with the remedy if the address is in use or not of this machine, or
  // if the path is too long, not a socket, or the socket of another server.
  explicit ListenSockets(const std::string& address);
  ~ListenSockets();
  ListenSockets(const ListenSockets&) = delete;
  ListenSockets& operator=(const ListenSockets&) = delete;

  // Stops listening and removes the own Unix socket. Also called by the destructor.
  void Close();
  // Non-blocking, close-on-exec.
  const std::vector<int>& descriptors() const { return descriptors_; }
  // The address as given, with the bound port.
  const std::string& address() const { return address_; }
  bool is_unix() const { return !path_.empty(); }

 private:
  void ListenOnUnix();
  void ListenOnTcp();
  // Binds each address of the host. Returns the bound port, or 0 and the last error if there is
  // none or the port is in use on one of them.
  int BindAll(const std::string& host, const std::string& port, bool both_families, int* error);

  std::string address_;
  std::string path_;         // path of the Unix socket; empty: TCP
  unsigned long inode_ = 0;  // inode of the socket file
  int lock_ = -1;            // lock of the path against other servers
  std::vector<int> descriptors_;
};

}  // namespace color3d
