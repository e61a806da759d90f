// Runs the tasks of a suite through the real client and a private server. Not thread-safe.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "tests/bench/suite/suite_plan.h"
#include "tests/bench/suite/suite_rows.h"

namespace color3d {

class TaskRunner {
 public:
  virtual ~TaskRunner() = default;
  // Runs a task for at most `limit_seconds`. A failed run is a row with the reason. Throws
  // Error{kCancelled}.
  virtual SuiteRow Run(const SuiteTask& task, double limit_seconds) = 0;
};

// A server with its data in out/server, and `color3d` for each task, with results in
// out/SCENE/PRESET/SEED. A run whose colorizer is needed and not there is done first, without a
// row. The server ends with the object.
class ClientRunner : public TaskRunner {
 public:
  // `programs`: folder with color3d and color3d-server. `server_arguments`: further options of
  // `color3d-server serve`.
  ClientRunner(std::filesystem::path programs,
               std::filesystem::path out,
               const std::vector<std::string>& server_arguments,
               const CancellationToken& cancel);
  ~ClientRunner() override;
  SuiteRow Run(const SuiteTask& task, double limit_seconds) override;

 private:
  class Server;
  const std::filesystem::path programs_, out_;
  const CancellationToken& cancel_;
  std::unique_ptr<Server> server_;
};

struct SuiteLimits {
  double budget_seconds = 0.0;  // 0: none
  double run_seconds = 3600.0;
  bool retry_failed = false;
};

// Runs the tasks that have no row in `jsonl`, or whose row failed if retry_failed, and appends
// their rows. Starts no run whose expected time exceeds the rest of the budget. Returns the number
// of tasks that are still open. Throws Error{kInvalidArgument} with the shortest expected time if
// the budget is below it, and the errors of the runner.
int RunTasks(const std::vector<SuiteTask>& tasks,
             const SuiteLimits& limits,
             const std::filesystem::path& jsonl,
             const std::function<std::unique_ptr<TaskRunner>()>& make_runner);

}  // namespace color3d
