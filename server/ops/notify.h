// Notifies systemd of the state of the service (sd_notify(3)). Does nothing without systemd.
#pragma once

#include <string>

namespace color3d {

// Sends "READY=1", "STOPPING=1", "WATCHDOG=1", ... to the socket in NOTIFY_SOCKET. Returns false if
// there is none or it cannot be reached.
bool NotifyServiceManager(const std::string& state);

}  // namespace color3d
