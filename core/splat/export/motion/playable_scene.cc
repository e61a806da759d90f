#include "core/splat/export/motion/playable_scene.h"

#include <algorithm>
#include <cmath>

#include "core/splat/export/motion/motion_file.h"
#include "core/splat/export/sog/sog.h"
#include "core/splat/model/model_parameters.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {
namespace {

constexpr double kLeastShownOpacity = 0.5 / 255.0;

double OpacityOf(float logit) { return 1.0 / (1.0 + std::exp(-static_cast<double>(logit))); }

// The largest value of the window of moving Gaussian `i` within t = -1..1.
double BestOfWindow(const GaussianMotion& motion, size_t i) {
  const double beyond = std::max(0.0, std::abs(static_cast<double>(motion.center[i])) - 1.0);
  const double scaled = beyond / std::exp(static_cast<double>(motion.log_width[i]));
  return std::exp(-0.5 * scaled * scaled);
}

void KeepRows(const std::vector<uint32_t>& rows, size_t width, std::vector<float>& buffer) {
  std::vector<float> kept;
  kept.reserve(rows.size() * width);
  for (const uint32_t i : rows) {
    kept.insert(kept.end(), buffer.begin() + i * width, buffer.begin() + (i + 1) * width);
  }
  buffer = std::move(kept);
}

// conjugate(q) s / |q|^2, quaternions w x y z: q + s tau is |q| (q / |q|) (1 + result tau).
void RelativeSpin(const float* q, const float* s, float* out) {
  const double norm = static_cast<double>(q[0]) * q[0] + static_cast<double>(q[1]) * q[1] +
                      static_cast<double>(q[2]) * q[2] + static_cast<double>(q[3]) * q[3];
  if (!(norm > 1e-24)) {
    std::fill_n(out, 4, 0.0f);
    return;
  }
  const double w = q[0] / norm, x = -q[1] / norm, y = -q[2] / norm, z = -q[3] / norm;
  out[0] = static_cast<float>(w * s[0] - x * s[1] - y * s[2] - z * s[3]);
  out[1] = static_cast<float>(w * s[1] + x * s[0] + y * s[3] - z * s[2]);
  out[2] = static_cast<float>(w * s[2] - x * s[3] + y * s[0] + z * s[1]);
  out[3] = static_cast<float>(w * s[3] + x * s[2] - y * s[1] + z * s[0]);
}

// In the order of the file: entry i of `order` is the model's Gaussian at place i.
MovingGaussians InOrder(const GaussianModel& model,
                        const ExportFrame& frame,
                        const std::vector<uint32_t>& order) {
  const GaussianMotion& motion = model.motion;
  const size_t first = model.size() - motion.size();
  MovingGaussians moving;
  moving.begin_s = motion.begin_s;
  moving.end_s = motion.end_s;
  moving.total = static_cast<uint32_t>(model.size());
  const auto scale = static_cast<float>(frame.scale);
  for (size_t place = 0; place < order.size(); ++place) {
    if (order[place] < first) continue;
    const size_t i = order[place] - first;
    moving.index.push_back(static_cast<uint32_t>(place));
    moving.center.push_back(motion.center[i]);
    moving.log_width.push_back(motion.log_width[i]);
    for (size_t k = 3 * i; k < 3 * i + 3; ++k) {
      moving.velocity.push_back(scale * motion.velocity[k]);
      moving.acceleration.push_back(scale * motion.acceleration[k]);
    }
    float spin[4];
    RelativeSpin(model.rotation.data() + 4 * order[place], motion.spin.data() + 4 * i, spin);
    moving.spin.insert(moving.spin.end(), spin, spin + 4);
  }
  return moving;
}

}  // namespace

bool IsPlayable(const GaussianModel& model) {
  return model.hexplane.empty() && model.motion.size() > 0;
}

GaussianModel EverSeen(const GaussianModel& model) {
  CheckModel(model);
  const size_t first = model.size() - model.motion.size();
  std::vector<uint32_t> rows, moving;
  for (size_t i = 0; i < model.size(); ++i) {
    double best = OpacityOf(model.opacity_logit[i]);
    if (i >= first) best *= BestOfWindow(model.motion, i - first);
    if (!(best >= kLeastShownOpacity)) continue;
    rows.push_back(static_cast<uint32_t>(i));
    if (i >= first) moving.push_back(static_cast<uint32_t>(i - first));
  }
  GaussianModel seen = model;
  KeepRows(rows, 3, seen.position);
  KeepRows(rows, 3, seen.log_scale);
  KeepRows(rows, 4, seen.rotation);
  KeepRows(rows, 1, seen.opacity_logit);
  KeepRows(rows, ShCoefficients(model.sh_degree), seen.sh_l);
  for (std::vector<float>* sh : {&seen.sh_a, &seen.sh_b}) {
    if (!sh->empty()) KeepRows(rows, ShCoefficients(model.chroma_sh_degree), *sh);
  }
  if (!seen.confidence.empty()) KeepRows(rows, 1, seen.confidence);
  KeepRows(moving, 3, seen.motion.velocity);
  KeepRows(moving, 3, seen.motion.acceleration);
  KeepRows(moving, 4, seen.motion.spin);
  KeepRows(moving, 1, seen.motion.center);
  KeepRows(moving, 1, seen.motion.log_width);
  return seen;
}

PlayableScene EncodePlayable(const GaussianModel& model,
                             const RgbHarmonics& rgb,
                             const ExportFrame& frame,
                             ThreadPool& pool) {
  const ViewerGaussians gaussians = ForViewers(model, rgb, frame, pool);
  PlayableScene scene;
  scene.sog = EncodeSog(gaussians, pool);
  const std::vector<uint32_t> order = SogOrder(gaussians.position);
  scene.motion = EncodeMotion(InOrder(model, frame, order));
  if (model.confidence.empty()) return scene;
  for (const uint32_t i : order) scene.confidence.push_back(model.confidence[i]);
  return scene;
}

}  // namespace color3d
