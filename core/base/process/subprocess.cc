#include "core/base/process/subprocess.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <set>
#include <string_view>
#include <thread>

#include "core/base/error.h"
#include "core/base/mutex.h"
#include "core/base/process/environment.h"

namespace color3d {
namespace {

// The program's full path, found as by a shell; empty if there is none.
std::string FindProgram(const std::string& name) {
  if (name.find('/') != std::string::npos) return ::access(name.c_str(), X_OK) == 0 ? name : "";
  const char* path = std::getenv("PATH");
  std::string folders = path != nullptr ? path : "/usr/local/bin:/usr/bin:/bin";
  size_t start = 0;
  while (start <= folders.size()) {
    size_t end = folders.find(':', start);
    if (end == std::string::npos) end = folders.size();
    const std::string candidate = folders.substr(start, end - start) + "/" + name;
    if (::access(candidate.c_str(), X_OK) == 0) return candidate;
    start = end + 1;
  }
  return "";
}

std::vector<char*> Pointers(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers;
}

// Given variables override inherited ones.
std::vector<std::string> VariablesOf(const SubprocessOptions& options) {
  std::vector<std::string> variables = options.environment;
  for (const std::string& variable : InheritedEnvironment()) {
    const std::string_view name = std::string_view(variable).substr(0, variable.find('=') + 1);
    const bool given = std::ranges::any_of(
        options.environment, [&](const std::string& own) { return own.starts_with(name); });
    if (!given) variables.push_back(variable);
  }
  return variables;
}

std::unique_ptr<Sandbox> PrepareSandbox(const SubprocessOptions& options,
                                        const std::string& program) {
  if (!options.sandbox) return nullptr;
  SandboxRules rules = *options.sandbox;
  rules.readable.emplace_back(program);
  return std::make_unique<Sandbox>(rules);
}

// Running children of RunSubprocess. Held while one is started, so that none ends unlisted.
Mutex g_children_mutex;
std::set<pid_t> g_children COLOR3D_GUARDED_BY(g_children_mutex);

// Lists the child until it was waited for.
class ListedChild {
 public:
  explicit ListedChild(pid_t child) COLOR3D_REQUIRES(g_children_mutex) : child_(child) {
    g_children.insert(child);
  }
  ~ListedChild() {
    const MutexLock lock(g_children_mutex);
    g_children.erase(child_);
  }
  ListedChild(const ListedChild&) = delete;
  ListedChild& operator=(const ListedChild&) = delete;

 private:
  const pid_t child_;
};

// A server blocks and ignores signals, which a program would inherit. Async-signal-safe.
void RestoreSignals() {
  for (int signal = 1; signal < NSIG; ++signal) ::signal(signal, SIG_DFL);
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
}

// Called in the child between fork and exec; the message is prepared in advance.
[[noreturn]] void GiveUp(std::string_view message) {
  [[maybe_unused]] const ssize_t written = ::write(2, message.data(), message.size());
  ::_exit(127);
}

}  // namespace

bool IsSubprocess(pid_t process) {
  const MutexLock lock(g_children_mutex);
  return g_children.contains(process);
}

SubprocessResult RunSubprocess(const SubprocessOptions& options, const CancellationToken& cancel) {
  const std::string program = FindProgram(options.arguments.at(0));
  if (program.empty()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "{} is not installed; run deploy/install-deps.sh",
                options.arguments[0]);
  }
  // Everything the child needs is prepared before fork: only async-signal-safe calls after it.
  std::vector<std::string> argument_texts = options.arguments;
  const std::vector<char*> arguments = Pointers(argument_texts);
  std::vector<std::string> variables = VariablesOf(options);
  const std::vector<char*> environment = Pointers(variables);
  const std::unique_ptr<Sandbox> sandbox = PrepareSandbox(options, program);
  const std::string log = options.log_path.empty() ? "/dev/null" : options.log_path.string();
  const int log_fd = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (log_fd < 0) {
    throw Error(ErrorCode::kFailedPrecondition, "cannot write {}: {}", log, strerror(errno));
  }
  const int null_fd = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  const pid_t parent = ::getpid();
  const auto start = std::chrono::steady_clock::now();
  MutexLock starting(g_children_mutex);
  const pid_t child = ::fork();
  if (child == 0) {
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);
    ::dup2(null_fd, 0);
    ::dup2(log_fd, 1);
    ::dup2(log_fd, 2);
    RestoreSignals();
    if (!LimitProcess(options.limits)) GiveUp("color3d: the kernel refuses the limits\n");
    if (sandbox && !sandbox->Enter()) GiveUp("color3d: the kernel refuses the sandbox\n");
    ::execve(program.c_str(), arguments.data(), environment.data());
    ::_exit(127);
  }
  ::close(log_fd);
  ::close(null_fd);
  if (child < 0) throw Error(ErrorCode::kResourceExhausted, "cannot start {}", program);
  const ListedChild listed(child);
  starting.Unlock();
  // Also here: whichever side runs first, the group exists before it may have to be killed.
  ::setpgid(child, child);

  SubprocessResult result;
  int status = 0;
  bool killed = false;
  auto nap = std::chrono::milliseconds(1);
  while (true) {
    const pid_t done = ::waitpid(child, &status, WNOHANG);
    if (done == child) break;
    if (done < 0 && errno != EINTR) {
      throw Error(ErrorCode::kInternal, "cannot wait for {}: {}", program, strerror(errno));
    }
    const auto elapsed = std::chrono::steady_clock::now() - start;
    if (!killed && (cancel.IsCancelled() || elapsed > options.timeout)) {
      result.timed_out = !cancel.IsCancelled();
      killed = true;
    }
    if (killed) ::kill(-child, SIGKILL);
    std::this_thread::sleep_for(nap);
    nap = std::min(nap * 2, std::chrono::milliseconds(50));
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (killed && !result.timed_out) cancel.ThrowIfCancelled();
  result.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

}  // namespace color3d
