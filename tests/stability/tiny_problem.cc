#include "tests/stability/tiny_problem.h"

#include <algorithm>
#include <cmath>

#include "core/base/random.h"

namespace color3d {

void TrainingWitness::OnError(int64_t, const std::string& name, double value) {
  non_finite += std::isfinite(value) ? 0 : 1;
  if (name == "restored_non_finite") ++restores;
  if (name.rfind("train_", 0) != 0) return;
  if (!seen_) first = value;
  seen_ = true;
  last = value;
}

PosedCamera OrbitCamera(int view, int width, int height, double angle_rad, bool turned) {
  PosedCamera posed;
  posed.view = view;
  posed.camera = {width, height, 1.0 * width, 1.0 * width, 0.5 * width, 0.5 * height};
  posed.cam_from_world.rotation = Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitY());
  posed.cam_from_world.translation = {0.0, 0.0, 3.0};
  if (turned) {
    const Eigen::Quaterniond half(Eigen::AngleAxisd(3.14159265358979, Eigen::Vector3d::UnitY()));
    posed.cam_from_world.rotation = half * posed.cam_from_world.rotation;
    posed.cam_from_world.translation = half * posed.cam_from_world.translation;
  }
  return posed;
}

GaussianModel CloudOf(int count, uint64_t seed) {
  Random random(seed);
  GaussianModel model;
  const auto uniform = [&](double low, double high) {
    return static_cast<float>(random.NextUniform(low, high));
  };
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) model.position.push_back(uniform(-0.8, 0.8));
    for (int k = 0; k < 3; ++k) model.log_scale.push_back(uniform(-3.0, -2.0));
    for (int k = 0; k < 4; ++k) {
      model.rotation.push_back(static_cast<float>(random.NextNormal()));
    }
    model.opacity_logit.push_back(uniform(-1.0, 2.0));
    model.sh_l.push_back(uniform(-0.5, 0.5));
  }
  return model;
}

Image Texture(int width, int height, int view) {
  Image l(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      l.At(0, y, x) =
          static_cast<float>(50.0 + 35.0 * std::sin(0.4 * x + view) * std::cos(0.3 * y));
    }
  }
  return l;
}

int64_t CountNonFinite(const GaussianModel& model) {
  int64_t bad = 0;
  for (const std::vector<float>* buffer : {&model.position,
                                           &model.log_scale,
                                           &model.rotation,
                                           &model.opacity_logit,
                                           &model.sh_l,
                                           &model.sh_a,
                                           &model.sh_b,
                                           &model.motion.velocity,
                                           &model.motion.acceleration,
                                           &model.motion.spin,
                                           &model.motion.center,
                                           &model.motion.log_width}) {
    bad += CountNonFinite(buffer->data(), buffer->size());
  }
  return bad;
}

StabilityResult MustRefuse(const std::vector<ErrorCode>& codes, const std::function<void()>& run) {
  StabilityResult result;
  result.condition_of = "-";
  try {
    run();
    result.held = false;
    result.outcome = "accepted, which is wrong";
  } catch (const Error& e) {
    result.held = std::find(codes.begin(), codes.end(), e.code()) != codes.end();
    result.outcome = std::string(ErrorCodeName(e.code())) + ": " + e.what();
  }
  return result;
}

}  // namespace color3d
