// Addresses as users write them: HOST:PORT or unix:PATH.
#pragma once

#include <string>

namespace color3d {

struct HostPort {
  std::string host;  // without the brackets of IPv6 addresses
  std::string port;
};

// Throws Error{kInvalidArgument} naming `text` unless it is HOST:PORT.
HostPort SplitHostPort(const std::string& text);

// Throws Error{kInvalidArgument} with `flag` and the expected form if the address has a scheme
// (http://), or if the path of a Unix socket is empty or longer than the system allows (107 bytes).
void CheckAddressForm(const std::string& flag, const std::string& address);

// Returns true if the address can be reached from this machine only (loopback or a Unix socket).
// Throws as SplitHostPort.
bool IsLoopback(const std::string& address);

}  // namespace color3d
