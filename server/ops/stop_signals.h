// Signal handling of the server. One object per process, created before other threads.
#pragma once

#include <signal.h>

#include <functional>

namespace color3d {

// Signals and their actions:
//   TERM, INT, QUIT, PWR, XCPU   drain
//   HUP                          drain if the program was started from a terminal, which has
//                                closed; else reload settings; ignored under nohup(1)
//   USR1, USR2, ALRM, VTALRM, PROF, IO, STKFLT, PIPE, XFSZ   ignored
// Holds for all threads created later; started programs get the default actions.
class StopSignals {
 public:
  StopSignals();

  // Returns at a signal to drain; calls `on_reload` at each signal to reload settings.
  void Wait(const std::function<void()>& on_reload) const;
  // The next TERM, INT or QUIT ends the process at once.
  void ExitOnNext() const;

 private:
  bool at_terminal_ = false;
  sigset_t signals_;
};

// Ignores signals that would end a program by default and have no meaning here.
void IgnoreStraySignals();

}  // namespace color3d
