// Asks an engine that starts workers (Slurm, Kubernetes, ...) for the number that the jobs need, by
// running a command of the operator. One thread; a command that fails or hangs delays nothing else.
// Thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "core/base/cancellation.h"
#include "core/base/mutex.h"

namespace color3d {

struct ScaleCommandOptions {
  // Absolute path; run as `program NUMBER`, without a shell and without tokens in its environment.
  std::filesystem::path program;
  int max_workers = 8;  // a larger demand is cut
  // What the last run printed; replaced by each run. In a folder where no worker writes.
  std::filesystem::path output;
  std::chrono::milliseconds poll{2'000};    // between looks at the demand
  std::chrono::milliseconds pause{30'000};  // from the end of a run to the next
  // Pause before the same number above 0 is told again, because engines end workers.
  std::chrono::milliseconds repeat{300'000};
  // After a failure the pause doubles up to this.
  std::chrono::milliseconds max_backoff{600'000};
  std::chrono::seconds time_limit{60};  // of a run; then its process group is killed
};

// Throws Error{kInvalidArgument} unless the path is absolute, Error{kFailedPrecondition} unless it
// is a program.
void CheckScaleCommand(const std::filesystem::path& program);

class ScaleCommand {
 public:
  // Returns the number of workers that the jobs could use now; nothing: another server asks. May
  // throw Error, which is logged once. Called by the thread of this object.
  using Demand = std::function<std::optional<int64_t>()>;

  // Runs the command for the first demand, also if that is 0, and after changes.
  ScaleCommand(ScaleCommandOptions options, Demand demand);
  // Kills a running command.
  ~ScaleCommand();
  ScaleCommand(const ScaleCommand&) = delete;
  ScaleCommand& operator=(const ScaleCommand&) = delete;

 private:
  using Steady = std::chrono::steady_clock;

  void Loop();
  void Look();
  // Returns what went wrong with its remedy; empty: nothing.
  std::string Run(int64_t workers);
  std::string Explain(int exit_code, bool timed_out) const;
  void OnSuccess(int64_t workers);
  void OnFailure(int64_t workers, const std::string& problem);

  const ScaleCommandOptions options_;
  const Demand demand_;
  CancellationToken cancel_;
  // Of the thread.
  std::optional<int64_t> told_;
  Steady::time_point next_run_{}, next_repeat_{};
  int failures_ = 0;     // consecutive
  std::string problem_;  // last one logged
  Mutex mutex_;
  CondVar wake_;
  bool stopping_ COLOR3D_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last, because it uses the others
};

}  // namespace color3d
