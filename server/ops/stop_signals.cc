#include "server/ops/stop_signals.h"

#include <fcntl.h>
#include <unistd.h>

#include <thread>

namespace color3d {

StopSignals::StopSignals() {
  const int terminal = ::open("/dev/tty", O_RDONLY | O_NOCTTY | O_CLOEXEC);
  at_terminal_ = terminal >= 0;
  if (at_terminal_) ::close(terminal);
  ::sigemptyset(&signals_);
  for (const int signal : {SIGTERM, SIGINT, SIGQUIT, SIGPWR, SIGXCPU}) {
    ::sigaddset(&signals_, signal);
  }
  // Stays ignored under nohup(1).
  struct sigaction hangup {};
  ::sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) ::sigaddset(&signals_, SIGHUP);
  ::pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  IgnoreStraySignals();
}

void StopSignals::Wait(const std::function<void()>& on_reload) const {
  while (true) {
    int signal = 0;
    ::sigwait(&signals_, &signal);
    if (signal != SIGHUP || at_terminal_) return;
    on_reload();
  }
}

void StopSignals::ExitOnNext() const {
  std::thread([signals = signals_] {
    int signal = 0;
    // A closing terminal may send it more than once.
    do {
      ::sigwait(&signals, &signal);
    } while (signal != SIGTERM && signal != SIGINT && signal != SIGQUIT);
    ::_exit(1);
  }).detach();
}

void IgnoreStraySignals() {
  for (const int signal :
       {SIGUSR1, SIGUSR2, SIGALRM, SIGVTALRM, SIGPROF, SIGIO, SIGSTKFLT, SIGPIPE, SIGXFSZ}) {
    ::signal(signal, SIG_IGN);
  }
}

}  // namespace color3d
