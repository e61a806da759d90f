// Drops file permissions of root for its lifetime, in this thread and those that it starts, for
// tests of permissions that run as root.
#pragma once

#include <sys/fsuid.h>
#include <unistd.h>

namespace color3d::testing {

class Unprivileged {
 public:
  Unprivileged() : is_root_(::geteuid() == 0) {
    if (is_root_) ::setfsuid(kNobody);
  }
  ~Unprivileged() {
    if (is_root_) ::setfsuid(0);
  }
  Unprivileged(const Unprivileged&) = delete;
  Unprivileged& operator=(const Unprivileged&) = delete;

 private:
  static constexpr uid_t kNobody = 65534;
  const bool is_root_;
};

}  // namespace color3d::testing
