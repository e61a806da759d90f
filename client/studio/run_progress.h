// State of one submitted job and its stages as the page shows it, gathered from its events. Not
// thread-safe.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "client/lib/run_estimate.h"
#include "color3d/v1/job.pb.h"

namespace color3d::client {

// "3f" of "jobs/3f".
std::string IdOf(const std::string& resource);

// A job without its stages: id, scene, kind, state, created_s, ended_s, key_view, error, warnings,
// waits_for, queue_position.
nlohmann::ordered_json JobFacts(const v1::Job& job);

class RunProgress {
 public:
  // `plan`: expected seconds of the stages; nullopt if unknown.
  RunProgress(const v1::Job& job, const std::optional<v1::JobPlan>& plan);

  void OnEvent(const v1::JobEvent& event);
  // JobFacts, with stages (kind, state, share 0..1, message, seconds, seconds_left), seconds_left
  // of the whole (null: unknown), expected_error (CIEDE2000, or null), and pictures: artifacts of
  // finished stages that a browser shows.
  nlohmann::ordered_json ToJson() const;

 private:
  double SecondsLeft(const v1::Job& stage) const;

  v1::Job job_;
  std::map<std::string, double> expected_;  // seconds, by kind
  std::map<std::string, v1::Job> stages_;   // by name
  RunEstimate estimate_;
};

}  // namespace color3d::client
