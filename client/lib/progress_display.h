// Progress on stderr: one redrawn line on a terminal, else a line at the end of every stage and at
// most one in 10 s between. Not thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "color3d/v1/job.pb.h"

namespace color3d::client {

class ProgressDisplay {
 public:
  // A quiet one (--json) prints nothing.
  explicit ProgressDisplay(bool quiet);
  ~ProgressDisplay();
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  void OnEvent(const v1::JobEvent& event);
  // Now and then while jobs are followed: says what they wait for when nothing runs for a while.
  // `look` gets the followed job as it is now, or throws; called at most every 5 s.
  void OnTick(const std::function<v1::Job()>& look);
  // A transfer, in bytes.
  void OnTransfer(const std::string& what, int64_t done_bytes, int64_t total_bytes);
  // Another loop of ours, in things of that name.
  void OnCount(const std::string& what, int64_t done, int64_t total);
  // A line of its own.
  void Say(const std::string& line);
  // Takes the redrawn line away.
  void Clear();

 private:
  void Draw(const std::string& line);
  int Width() const;
  bool SomethingRuns() const;

  const bool quiet_;
  const bool terminal_;
  bool drawn_ = false;
  bool failure_told_ = false;
  std::chrono::steady_clock::time_point last_;
  std::map<std::string, bool> ended_;  // by job name
  std::map<std::string, v1::Job::State> unfinished_;
  std::chrono::steady_clock::time_point idle_since_;
  std::chrono::steady_clock::time_point last_look_;
  std::string waits_for_ = "a worker";
};

}  // namespace color3d::client
