// Small training problems without files.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/progress.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/training/posed_camera.h"
#include "tests/stability/stability_case.h"

namespace color3d {

// Counts the reports of a trainer.
class TrainingWitness : public ProgressObserver {
 public:
  void OnProgress(int64_t, int64_t, const std::string&) override {}
  void OnError(int64_t, const std::string& name, double value) override;
  void OnWarning(const std::string& message) override { warnings.push_back(message); }
  int64_t non_finite = 0;          // points of curves
  double first = 0.0, last = 0.0;  // training error
  int64_t restores = 0;            // points of the curve "restored_non_finite"
  std::vector<std::string> warnings;

 private:
  bool seen_ = false;
};

// A camera of width x height px at `angle_rad` around the y axis, three units from the origin,
// which it faces. `turned`: it faces away.
PosedCamera OrbitCamera(int view, int width, int height, double angle_rad, bool turned = false);

// `count` Gaussians of random colour in a cube of half side 0.8 around the origin.
GaussianModel CloudOf(int count, uint64_t seed);

// L in 0..100, smooth, different for every view.
Image Texture(int width, int height, int view);

int64_t CountNonFinite(const GaussianModel& model);

// A case that must throw an Error with one of these codes.
StabilityResult MustRefuse(const std::vector<ErrorCode>& codes, const std::function<void()>& run);

}  // namespace color3d
