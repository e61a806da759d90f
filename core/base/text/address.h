// Addresses as users write them: HOST:PORT or unix:PATH.
#pragma once

#include <string>

namespace color3d {

struct HostPort {
  std::string host;  // without the brackets of IPv6
  std::string port;
};

// Throws Error{kInvalidArgument} naming `text` unless it is HOST:PORT.
HostPort SplitHostPort(const std::string& text);

// Throws Error{kInvalidArgument} that begins with `flag` and says how to write it: when the address
// begins with a scheme (http://), which none has, and when it is a Unix socket's whose path is
// missing or longer than the system allows (107 bytes).
void CheckAddressForm(const std::string& flag, const std::string& address);

// Whether the address can be reached from this machine only (loopback or a Unix socket). Throws as
// SplitHostPort.
bool IsLoopback(const std::string& address);

}  // namespace color3d
