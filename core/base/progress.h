// Progress of long computations: trainers, solvers and child processes report here, and a stage
// turns the reports into events and error-against-time curves.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace color3d {

class ProgressObserver {
 public:
  virtual ~ProgressObserver() = default;
  // `step` of `total_steps` (total 0: unknown) is done. Called often; must be cheap.
  virtual void OnProgress(int64_t step, int64_t total_steps, const std::string& message) = 0;
  // One point of an error-against-time curve; the observer adds the seconds. `value` may be any
  // finite number; `error_name` says what it is, e.g. "train_l1" or "heldout_psnr_l_db".
  virtual void OnError(int64_t iteration, const std::string& error_name, double value) = 0;
  // A warning for the report; the computation continues.
  virtual void OnWarning(const std::string& message) = 0;
};

// Ignores everything.
class NullObserver : public ProgressObserver {
 public:
  void OnProgress(int64_t, int64_t, const std::string&) override {}
  void OnError(int64_t, const std::string&, double) override {}
  void OnWarning(const std::string&) override {}
};

// Checkpoints of a trainer, from which another process can resume. The bytes are opaque.
class CheckpointStore {
 public:
  virtual ~CheckpointStore() = default;
  // The newest saved state, or nullopt if there is none.
  virtual std::optional<std::string> Load() = 0;
  // True when enough time has passed since the last Save that saving again is worth its cost.
  virtual bool WantsSave() = 0;
  // Durable when it returns. Throws Error{kAborted} when this worker has lost its lease.
  virtual void Save(const std::string& state) = 0;
  // The same for states too large for memory. Writes the newest state to `file`; returns false if
  // there is none.
  virtual bool LoadTo(const std::filesystem::path& file);
  // Moves a file of the scratch folder into the store. By default LoadTo and SaveFile use Load
  // and Save; a stage uses one pair only.
  virtual void SaveFile(const std::filesystem::path& file);
};

// Never resumes, never saves.
class NoCheckpoints : public CheckpointStore {
 public:
  std::optional<std::string> Load() override { return std::nullopt; }
  bool WantsSave() override { return false; }
  void Save(const std::string&) override {}
};

}  // namespace color3d
