// What signals mean to the server. One object a process, made before other threads are.
#pragma once

#include <signal.h>

#include <functional>

namespace color3d {

//   TERM, INT, QUIT, PWR, XCPU   drain
//   HUP                          drain where the program was started at a terminal, which is gone
//                                then; else it is somebody who asks to read settings again;
//                                nothing under nohup(1)
//   USR1, USR2, ALRM, VTALRM, PROF, IO, STKFLT, PIPE, XFSZ   nothing
// The same for all threads that are made later; programs that we start have the defaults.
class StopSignals {
 public:
  StopSignals();

  // Until one says to drain; `on_reload` is called at each that asks to read settings again.
  void Wait(const std::function<void()>& on_reload) const;
  // The next TERM, INT or QUIT ends the process at once.
  void ExitOnNext() const;

 private:
  bool at_terminal_ = false;
  sigset_t signals_;
};

// Those that end a program which does not look after them, and that ours let pass.
void IgnoreStraySignals();

}  // namespace color3d
