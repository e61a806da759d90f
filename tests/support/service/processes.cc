#include "tests/support/service/processes.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <iterator>
#include <thread>

#include "core/base/error.h"

namespace color3d {
namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::steady_clock;
namespace {

std::string Slurp(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// Only async-signal-safe calls between fork and exec.
[[noreturn]] void ExecChild(char* const* argv, int out, int err, pid_t parent) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(126);
  const int null = open("/dev/null", O_RDONLY);
  dup2(null, STDIN_FILENO);
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  execvp(argv[0], argv);
  _exit(127);
}

int OpenLog(const fs::path& path) {
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) {
    throw Error(ErrorCode::kFailedPrecondition, path.string() + " cannot be written");
  }
  return fd;
}

}  // namespace

Process::Process(std::vector<std::string> arguments, const fs::path& log_folder) {
  static std::atomic<int> counter{0};
  const std::string stem = "process" + std::to_string(counter++);
  fs::create_directories(log_folder);
  out_path_ = log_folder / (stem + ".out");
  err_path_ = log_folder / (stem + ".err");
  const int out = OpenLog(out_path_), err = OpenLog(err_path_);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) ExecChild(argv.data(), out, err, parent);
  close(out);
  close(err);
  if (pid_ < 0) throw Error(ErrorCode::kResourceExhausted, "cannot start a process");
  setpgid(pid_, pid_);  // both sides do it, so that neither has to wait for the other
}

Process::~Process() { Kill(); }

bool Process::IsRunning() { return !Wait(milliseconds(0)).has_value(); }

void Process::Signal(int signal) {
  if (!exit_code_) kill(pid_, signal);
}

std::optional<int> Process::Wait(milliseconds limit) {
  const auto deadline = steady_clock::now() + limit;
  while (!exit_code_) {
    int status = 0;
    const pid_t done = waitpid(pid_, &status, WNOHANG);
    if (done == pid_) {
      exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    } else if (done < 0) {
      exit_code_ = -1;
    } else if (steady_clock::now() >= deadline) {
      return std::nullopt;
    } else {
      std::this_thread::sleep_for(milliseconds(20));
    }
  }
  return exit_code_;
}

void Process::Kill() {
  if (exit_code_) return;
  // Descendants may have their own groups, so they are listed before their parent ends.
  std::vector<pid_t> family = Descendants(pid_);
  kill(-pid_, SIGKILL);
  for (pid_t pid : family) kill(pid, SIGKILL);
  Wait(std::chrono::seconds(10));
}

std::string Process::Out() const { return Slurp(out_path_); }
std::string Process::Err() const { return Slurp(err_path_); }

ProcessResult RunProcess(const std::vector<std::string>& arguments,
                         const fs::path& log_folder,
                         std::chrono::seconds limit) {
  const auto start = steady_clock::now();
  Process process(arguments, log_folder);
  ProcessResult result;
  const std::optional<int> code = process.Wait(limit);
  result.timed_out = !code.has_value();
  result.exit_code = code.value_or(-1);
  process.Kill();
  result.seconds = std::chrono::duration<double>(steady_clock::now() - start).count();
  result.out = process.Out();
  result.err = process.Err();
  return result;
}

bool IsAlive(pid_t pid) {
  // "pid (name) state ...": the name may hold anything, the state follows the last parenthesis.
  const std::string stat = Slurp("/proc/" + std::to_string(pid) + "/stat");
  const size_t end = stat.rfind(')');
  return end != std::string::npos && end + 2 < stat.size() && stat[end + 2] != 'Z';
}

std::vector<pid_t> Descendants(pid_t pid) {
  std::vector<pid_t> found, open{pid};
  while (!open.empty()) {
    const fs::path tasks = "/proc/" + std::to_string(open.back()) + "/task";
    open.pop_back();
    std::error_code error;
    for (const auto& task : fs::directory_iterator(tasks, error)) {
      std::ifstream children(task.path() / "children");
      for (pid_t child = 0; children >> child;) {
        found.push_back(child);
        open.push_back(child);
      }
    }
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  std::erase_if(found, [](pid_t child) { return !IsAlive(child); });
  return found;
}

bool WaitUntil(const std::function<bool()>& condition, milliseconds limit, milliseconds step) {
  const auto deadline = steady_clock::now() + limit;
  while (!condition()) {
    if (steady_clock::now() >= deadline) return false;
    std::this_thread::sleep_for(step);
  }
  return true;
}

}  // namespace color3d
