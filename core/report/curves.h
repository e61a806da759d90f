// Error curves over time: points (seconds, iteration, error) of the stages that iterate.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/mutex.h"
#include "core/base/progress.h"

namespace color3d {

struct CurvePoint {
  std::string stage;
  double seconds = 0.0;  // of computing since the start of the stage, over all attempts
  int64_t iteration = 0;
  std::string error_name;
  double value = 0.0;
};

// "stage,seconds,iteration,error_name,value" with one header line.
std::string CurvesToCsv(const std::vector<CurvePoint>& points);
// Throws Error{kInvalidArgument} with the line.
std::vector<CurvePoint> CurvesFromCsv(std::string_view csv);

// Observer of a stage that records its errors with their time and passes all calls on. Also wraps
// the checkpoints, so that the curve and the clock of a resumed stage continue. OnProgress, OnError
// and OnWarning are thread-safe.
class CurveRecorder : public ProgressObserver, public CheckpointStore {
 public:
  // Requires: both references outlive the recorder.
  CurveRecorder(std::string stage, ProgressObserver& outer, CheckpointStore& checkpoints);

  void OnProgress(int64_t step, int64_t total_steps, const std::string& message) override;
  void OnError(int64_t iteration, const std::string& error_name, double value) override;
  void OnWarning(const std::string& message) override;

  std::optional<std::string> Load() override;
  bool WantsSave() override { return checkpoints_.WantsSave(); }
  void Save(const std::string& state) override;
  bool LoadTo(const std::filesystem::path& file) override;
  void SaveFile(const std::filesystem::path& file) override;

  double Seconds() const;
  std::vector<CurvePoint> points() const;

 private:
  // The part of a checkpoint beside the state of the stage.
  std::string Facts() const;
  void TakeFacts(double seconds, std::string_view csv);

  std::string stage_;
  ProgressObserver& outer_;
  CheckpointStore& checkpoints_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double earlier_seconds_ = 0.0;  // set by Load() and LoadTo()
  mutable Mutex mutex_;
  std::vector<CurvePoint> points_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d
