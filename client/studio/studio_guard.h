// Who may use the studio: the browser that opened the address with the token, from the studio's own
// page. Keeps out other users, other pages (Origin) and names that lead to loopback (Host).
// Thread-safe.
#pragma once

#include <string>

#include "core/base/mutex.h"

namespace httplib {
struct Request;
}

namespace color3d::client {

// 256 bits of the system's random numbers, as 64 hexadecimal digits. Throws Error{kInternal}.
std::string NewSecret();

// Compares in a time that does not depend on where the texts differ.
bool AreEqualSecrets(const std::string& left, const std::string& right);

class StudioGuard {
 public:
  explicit StudioGuard(int port);

  // Secret of the address; it opens the studio once.
  const std::string& token() const { return token_; }
  // Value of Set-Cookie for the browser that presents the token; empty if the token is wrong or was
  // used before.
  std::string Exchange(const std::string& token);

  // Whether the token has let a browser in.
  bool is_used() const;

  struct Verdict {
    int status = 200;    // of HTTP; 200: may pass
    std::string reason;  // for the user
  };
  // Judges Host and Origin of any request.
  Verdict CheckOrigin(const httplib::Request& request) const;
  // Judges its cookie.
  Verdict CheckCookie(const httplib::Request& request) const;

 private:
  const std::string token_, session_;
  const std::string port_, cookie_;
  mutable Mutex mutex_;
  bool is_used_ COLOR3D_GUARDED_BY(mutex_) = false;
};

}  // namespace color3d::client
