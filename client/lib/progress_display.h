// Progress on stderr, with the estimated error of the run once it is known: on terminals one line
// that is redrawn, else a line at the end of each stage and at most one every 10 s in between. Not
// thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "client/lib/run_estimate.h"
#include "color3d/v1/job.pb.h"

namespace color3d::client {

class ProgressDisplay {
 public:
  // `quiet` (--json): prints nothing.
  explicit ProgressDisplay(bool quiet);
  ~ProgressDisplay();
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  void OnEvent(const v1::JobEvent& event);
  // Call it regularly as jobs are followed: prints the reason for waiting if nothing runs for a
  // while. `look` returns the current state of the followed job, or throws; called at most every 5
  // s.
  void OnTick(const std::function<v1::Job()>& look);
  // Progress of a transfer, bytes.
  void OnTransfer(const std::string& what, int64_t done_bytes, int64_t total_bytes);
  // Progress of a loop in the client; `what`: plural noun of its items.
  void OnCount(const std::string& what, int64_t done, int64_t total);
  // Prints a separate line.
  void PrintLine(const std::string& line);
  // Erases the redrawn line.
  void Clear();

 private:
  void Draw(const std::string& line);
  int Width() const;
  bool IsAnyStageRunning() const;

  const bool quiet_;
  const bool terminal_;
  bool drawn_ = false;
  bool failure_told_ = false;
  std::chrono::steady_clock::time_point last_;
  std::map<std::string, bool> ended_;  // by job name
  RunEstimate estimate_;
  std::string told_estimate_;  // of the newest line of a finished stage
  std::map<std::string, v1::Job::State> unfinished_;
  std::chrono::steady_clock::time_point idle_since_;
  std::chrono::steady_clock::time_point last_look_;
  std::string waits_for_ = "a worker";
};

}  // namespace color3d::client
