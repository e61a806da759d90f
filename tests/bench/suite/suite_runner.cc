#include "tests/bench/suite/suite_runner.h"

#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <utility>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/process/subprocess.h"
#include "core/catalogue/artifacts.h"
#include "tests/support/service/processes.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// The last line of a log that is not empty.
std::string LastLine(const fs::path& log) {
  if (!fs::exists(log)) return "";
  const std::string text = ReadFile(log);
  const size_t end = text.find_last_not_of("\n\r ");
  if (end == std::string::npos) return "";
  const size_t begin = text.find_last_of("\n\r", end);
  return text.substr(begin == std::string::npos ? 0 : begin + 1, end - (begin + 1) + 1);
}

std::map<std::string, double> ViewErrors(const fs::path& scores) {
  std::map<std::string, double> errors;
  if (!fs::exists(scores)) return errors;
  const nlohmann::json json = nlohmann::json::parse(ReadFile(scores));
  for (const auto& view : json.at("views")) {
    const auto error = view.find("delta_e00_chroma");
    if (error != view.end() && error->is_number()) errors[view.at("view")] = error->get<double>();
  }
  return errors;
}

}  // namespace

class ClientRunner::Server {
 public:
  Server(const fs::path& programs, const fs::path& out, const std::vector<std::string>& options) {
    const fs::path port = out / "server.port";
    fs::remove(port);
    std::vector<std::string> arguments = {(programs / "color3d-server").string(),
                                          "serve",
                                          "--data-dir",
                                          (out / "server").string(),
                                          "--listen",
                                          "127.0.0.1:0",
                                          "--port-file",
                                          port.string()};
    arguments.insert(arguments.end(), options.begin(), options.end());
    process_ = std::make_unique<Process>(arguments, out);
    const bool ready = WaitUntil(
        [&] { return !process_->IsRunning() || (fs::exists(port) && fs::file_size(port) > 0); },
        std::chrono::seconds(60));
    if (!ready || !process_->IsRunning()) {
      throw Error(ErrorCode::kFailedPrecondition, "the server did not start: {}", process_->Err());
    }
    address_ = ReadFile(port);
    while (!address_.empty() && address_.back() == '\n') address_.pop_back();
  }
  ~Server() {
    process_->Signal(SIGTERM);
    process_->Wait(std::chrono::seconds(30));  // then it is killed
  }
  const std::string& address() const { return address_; }

 private:
  std::unique_ptr<Process> process_;
  std::string address_;
};

ClientRunner::ClientRunner(fs::path programs,
                           fs::path out,
                           const std::vector<std::string>& server_arguments,
                           const CancellationToken& cancel)
    : programs_(std::move(programs)), out_(std::move(out)), cancel_(cancel) {
  server_ = std::make_unique<Server>(programs_, out_, server_arguments);
}

ClientRunner::~ClientRunner() = default;

SuiteRow ClientRunner::Run(const SuiteTask& task, double limit_seconds) {
  if (task.colorizer_of != nullptr && !fs::exists(out_ / task.ColorizerFile())) {
    const SuiteRow other = Run(*task.colorizer_of, limit_seconds);
    if (other.Failed()) {
      SuiteRow row{task.scene.name, task.preset.name, task.seed, task.options_digest};
      row.failure = fmt::format("{}, {}: {}", other.scene, other.preset, other.failure);
      return row;
    }
  }
  const fs::path out = out_ / task.Results();
  fs::remove_all(out);
  fs::create_directories(out);
  SubprocessOptions child;
  child.arguments = task.Arguments(out_);
  child.arguments.insert(child.arguments.begin(), (programs_ / "color3d").string());
  child.environment = {"COLOR3D_SERVER=" + server_->address()};
  child.log_path = out / "log.txt";
  child.timeout = std::chrono::seconds(std::max<int64_t>(1, std::llround(limit_seconds)));
  const SubprocessResult result = RunSubprocess(child, cancel_);
  SuiteRow row{task.scene.name, task.preset.name, task.seed, task.options_digest};
  row.wall_seconds = result.seconds;
  if (result.timed_out) {
    row.failure = fmt::format("stopped after {:.0f} s", result.seconds);
  } else if (result.exit_code != 0 || !fs::exists(out / artifact::kMetrics)) {
    row.failure = fmt::format("exit code {}: {}", result.exit_code, LastLine(child.log_path));
  } else {
    row.metrics = nlohmann::ordered_json::parse(ReadFile(out / artifact::kMetrics));
    row.view_errors = ViewErrors(out / artifact::kScores);
  }
  return row;
}

int RunTasks(const std::vector<SuiteTask>& tasks,
             const SuiteLimits& limits,
             const fs::path& jsonl,
             const std::function<std::unique_ptr<TaskRunner>()>& make_runner) {
  std::vector<SuiteRow> rows = ReadRows(jsonl);
  std::vector<SuiteTask> open;
  for (const SuiteTask& task : tasks) {
    const auto row =
        std::find_if(rows.begin(), rows.end(), [&](const SuiteRow& r) { return r.IsOf(task); });
    if (row == rows.end() || (row->Failed() && limits.retry_failed)) open.push_back(task);
  }
  if (open.empty()) return 0;
  if (limits.budget_seconds > 0.0) {
    double shortest = HUGE_VAL;
    for (const SuiteTask& task : open) shortest = std::min(shortest, ExpectedSeconds(task, rows));
    if (limits.budget_seconds < shortest) {
      throw InvalidArgument("a budget of {:.0f} s is below the shortest open run, {:.0f} s",
                            limits.budget_seconds,
                            shortest);
    }
  }
  const Clock::time_point start = Clock::now();
  const std::unique_ptr<TaskRunner> runner = make_runner();
  int left = 0;
  for (const SuiteTask& task : open) {
    const double rest = limits.budget_seconds > 0.0 ? limits.budget_seconds - SecondsSince(start)
                                                    : limits.run_seconds;
    if (rest <= ExpectedSeconds(task, rows)) {
      ++left;
      continue;
    }
    const bool cut = rest < limits.run_seconds;
    SuiteRow row = runner->Run(task, std::min(rest, limits.run_seconds));
    if (row.Failed() && cut && row.wall_seconds >= std::floor(rest)) {
      ++left;  // the budget ended, not the run
      continue;
    }
    AppendRow(jsonl, row);
    std::fprintf(
        stderr,
        "%s, %s, seed %llu: %s\n",
        row.scene.c_str(),
        row.preset.c_str(),
        static_cast<unsigned long long>(row.seed),
        row.Failed() ? row.failure.c_str() : fmt::format("{:.0f} s", row.wall_seconds).c_str());
    rows.push_back(std::move(row));
  }
  return left;
}

}  // namespace color3d
