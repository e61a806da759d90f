// A colorizer that starts from another scene's network instead of a random one: an experiment of
// `color3d-bench choices`, made of training checkpoints. Not thread-safe.
#pragma once

#include <optional>
#include <string>

#include "core/base/progress.h"
#include "core/colorizer/colorizer.h"

namespace color3d {

// Keeps the last state that training leaves.
class LastCheckpoint : public CheckpointStore {
 public:
  std::optional<std::string> Load() override { return std::nullopt; }
  bool WantsSave() override { return true; }
  void Save(const std::string& state) override { state_ = state; }
  const std::string& state() const { return state_; }

 private:
  std::string state_;
};

// Gives out one state.
class GivenCheckpoint : public CheckpointStore {
 public:
  explicit GivenCheckpoint(std::string state) : state_(std::move(state)) {}
  std::optional<std::string> Load() override { return state_; }
  bool WantsSave() override { return false; }
  void Save(const std::string&) override {}

 private:
  std::string state_;
};

// Iteration 0 of a training with `options` on the pictures that `own` was trained on, with the
// network and the frozen statistics of `other`. Both are states of training with one encoder.
// Throws Error{kInvalidArgument} for anything else.
std::string WarmStartState(const std::string& own,
                           const std::string& other,
                           const ColorizerOptions& options);

}  // namespace color3d
