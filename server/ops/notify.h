// The protocol by which a service tells systemd how it is (sd_notify(3)). Without systemd nothing
// happens.
#pragma once

#include <string>

namespace color3d {

// "READY=1", "STOPPING=1", "WATCHDOG=1", ... to the socket in NOTIFY_SOCKET. False when there is
// none, or when it cannot be reached.
bool NotifyServiceManager(const std::string& state);

}  // namespace color3d
