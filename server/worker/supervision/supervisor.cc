#include "server/worker/supervision/supervisor.h"

#include <signal.h>
#include <spawn.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>

#include "core/base/process/environment.h"
#include "core/base/process/subprocess.h"
#include "server/ops/process_state.h"

namespace color3d {
namespace {
constexpr auto kTick = std::chrono::milliseconds(50);
constexpr auto kListening = std::chrono::seconds(2);
constexpr auto kOrphans = std::chrono::milliseconds(500);
// A worker that ran this long did not fail to start.
constexpr auto kHealthyLife = std::chrono::seconds(60);

}  // namespace

Supervisor::Supervisor(const SupervisorOptions& options, ChoreStore& store)
    : options_(options), store_(store) {
  kill_at_ = SteadyClock::time_point::max();
  for (int i = 0; i < options_.workers; ++i) {
    Slot slot;
    slot.name = "worker-" + std::to_string(i + 1);
    slots_.push_back(slot);
  }
  if (options_.inference_demand) {
    Slot slot;
    slot.name = "inference";
    slot.on_demand = true;
    slots_.push_back(slot);
  }
  thread_ = std::thread([this] { Loop(); });
}

Supervisor::~Supervisor() {
  Drain(std::chrono::milliseconds(0));
  Wait();
}

void Supervisor::Drain(std::chrono::milliseconds grace) {
  const SteadyClock::time_point kill_at = SteadyClock::now() + grace;
  if (kill_at < kill_at_.load()) kill_at_ = kill_at;
  draining_ = true;
}

void Supervisor::Wait() {
  if (thread_.joinable()) thread_.join();
}

bool Supervisor::IsWanted(const Slot& slot) const {
  return !slot.on_demand || options_.inference_demand->Recent();
}

void Supervisor::StartWorker(Slot* slot) {
  const std::vector<std::string>& own =
      slot->on_demand ? options_.inference_arguments : options_.arguments;
  std::vector<std::string> arguments = {options_.program.string()};
  arguments.insert(arguments.end(), own.begin(), own.end());
  arguments.insert(arguments.end(),
                   {"--name", slot->name, "--parent-pid", std::to_string(::getpid())});
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  // Default signals (the server blocks them), and a separate process group, so that Ctrl-C reaches
  // only the server, which then drains its workers.
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  sigset_t none;
  ::sigemptyset(&none);
  sigset_t defaults;
  ::sigfillset(&defaults);
  ::posix_spawnattr_setsigmask(&attributes, &none);
  ::posix_spawnattr_setsigdefault(&attributes, &defaults);
  ::posix_spawnattr_setpgroup(&attributes, 0);
  ::posix_spawnattr_setflags(
      &attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  // Without tokens and keys, because workers decode untrusted files.
  std::vector<std::string> variables = InheritedEnvironment();
  std::vector<char*> environment;
  for (std::string& variable : variables) environment.push_back(variable.data());
  environment.push_back(nullptr);
  pid_t pid = 0;
  const int error = ::posix_spawn(
      &pid, options_.program.c_str(), nullptr, &attributes, argv.data(), environment.data());
  ::posix_spawnattr_destroy(&attributes);
  slot->started = SteadyClock::now();
  if (error != 0) {
    slot->backoff = std::clamp(slot->backoff * 2, options_.first_backoff, options_.max_backoff);
    slot->next_start = slot->started + slot->backoff;
    spdlog::error("cannot start {}: {}", options_.program.string(), std::strerror(error));
    return;
  }
  slot->pid = pid;
  slot->last_moving = slot->last_heard = slot->started;
  spdlog::info("{} started (pid {})", slot->name, pid);
}

void Supervisor::OnExit(Slot* slot, int status) {
  const std::string id = slot->name + "-" + std::to_string(slot->pid);
  const bool clean = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  std::string jobs;
  try {
    for (const std::string& job : store_.ExpireLeases(id)) jobs += " [job=" + job + "]";
    store_.RemoveWorker(id);
  } catch (const Error& e) {
    spdlog::warn("{}: {}", id, e.what());
  }
  if (clean) {
    spdlog::info("{} ended", id);
  } else if (WIFSIGNALED(status)) {
    spdlog::error("{} was killed by signal {} ({}){}",
                  id,
                  WTERMSIG(status),
                  ::strsignal(WTERMSIG(status)),
                  jobs);
  } else {
    spdlog::error("{} ended with status {}{}", id, WEXITSTATUS(status), jobs);
  }
  const auto now = SteadyClock::now();
  if (clean || now - slot->started > kHealthyLife) {
    slot->backoff = std::chrono::milliseconds(0);
  } else {
    slot->backoff = std::clamp(slot->backoff * 2, options_.first_backoff, options_.max_backoff);
  }
  // Ends without a fault (recycling) are restarted soon, but with a minimum pause.
  slot->next_start = now + std::max(slot->backoff, std::chrono::milliseconds(50));
  slot->pid = 0;
}

void Supervisor::CheckWorker(Slot* slot) {
  if (slot->pid == 0) {
    const bool due = SteadyClock::now() >= slot->next_start;
    if (!draining_.load() && due && IsWanted(*slot)) StartWorker(slot);
    return;
  }
  int status = 0;
  const pid_t ended = ::waitpid(slot->pid, &status, WNOHANG);
  if (ended == slot->pid) {
    OnExit(slot, status);
  } else {
    KillIfFrozen(slot);
  }
}

void Supervisor::KillIfFrozen(Slot* slot) {
  const auto now = SteadyClock::now();
  if (!IsStopped(slot->pid)) {
    slot->last_moving = now;
    return;
  }
  if (now - slot->last_moving <= options_.max_stopped) return;
  spdlog::error("{} (pid {}) is stopped for too long; killing it", slot->name, slot->pid);
  ::kill(slot->pid, SIGKILL);
  slot->last_moving = now;
}

bool Supervisor::IsStoreFull() const {
  try {
    return store_.IsFull();
  } catch (const Error& e) {
    spdlog::warn("cannot check whether the disk is full: {}", e.what());
    return false;
  }
}

// A worker that hangs between attempts has no lease that could expire.
void Supervisor::KillSilentWorkers() {
  const auto now = SteadyClock::now();
  if (now < next_listening_) return;
  next_listening_ = now + std::min<SteadyClock::duration>(kListening, options_.max_silent / 4);
  std::map<std::string, int64_t> reports;
  try {
    for (const WorkerRecord& worker : store_.ListWorkers()) {
      reports[worker.worker_id] = worker.heartbeat_ms;
    }
  } catch (const Error& e) {
    spdlog::warn("cannot supervise workers: {}", e.what());
    return;
  }
  for (Slot& slot : slots_) {
    const auto report = reports.find(slot.name + "-" + std::to_string(slot.pid));
    const int64_t heard = report != reports.end() ? report->second : 0;
    if (slot.pid == 0 || heard != slot.report_ms) {
      slot.report_ms = heard;
      slot.last_heard = now;
    } else if (now - slot.last_heard > options_.max_silent) {
      slot.last_heard = now;
      if (IsStoreFull()) continue;
      spdlog::error("{} (pid {}) does not report; killing it", slot.name, slot.pid);
      ::kill(slot.pid, SIGKILL);
    }
  }
}

void Supervisor::EndOrphans() {
  const auto now = SteadyClock::now();
  if (!options_.orphans || now < next_orphans_) return;
  next_orphans_ = now + kOrphans;
  for (const std::string& id : options_.orphans->Look()) {
    try {
      for (const std::string& job : store_.ExpireLeases(id)) {
        spdlog::info("[job={}] its worker {} has ended", job, id);
      }
      store_.RemoveWorker(id);
    } catch (const Error& e) {
      spdlog::warn("{}: {}", id, e.what());
    }
  }
}

// As the first process of a container, the server inherits orphaned processes.
void Supervisor::ReapInheritedProcesses() {
  while (true) {
    siginfo_t ended{};
    if (::waitid(P_ALL, 0, &ended, WEXITED | WNOHANG | WNOWAIT) != 0 || ended.si_pid == 0) return;
    const auto is_it = [&](const Slot& slot) { return slot.pid == ended.si_pid; };
    if (std::ranges::any_of(slots_, is_it)) return;  // in the next round
    if (IsSubprocess(ended.si_pid)) return;          // another thread waits for it
    ::waitpid(ended.si_pid, nullptr, WNOHANG);
  }
}

void Supervisor::Loop() {
  while (true) {
    for (Slot& slot : slots_) CheckWorker(&slot);
    ReapInheritedProcesses();
    EndOrphans();
    KillSilentWorkers();
    if (draining_.load()) {
      const bool kill = SteadyClock::now() >= kill_at_.load();
      bool running = false;
      for (Slot& slot : slots_) {
        if (slot.pid == 0) continue;
        running = true;
        if (kill) {
          ::kill(slot.pid, SIGKILL);
        } else if (!slot.told && !(slot.on_demand && options_.inference_demand->Held())) {
          ::kill(slot.pid, SIGTERM);
          slot.told = true;
        }
      }
      if (!running) return;
    }
    std::this_thread::sleep_for(kTick);
  }
}

}  // namespace color3d
