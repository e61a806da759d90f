// Splat files of extreme Gaussians: read back, and compared with the numbers that were written.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/splat/export/export.h"
#include "core/splat/export/glb/glb.h"
#include "core/splat/export/sog/sog.h"
#include "core/splat/export/splat4d/splat4d.h"
#include "core/splat/export/spz/spz.h"
#include "core/splat/import/splat_file.h"
#include "tests/stability/tiny_problem.h"

namespace color3d {
namespace {

constexpr int kCount = 200;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// Scales of e^-18 to e^14 (1e-8 to 1e6), opacities of 1e-13 to 1 - 1e-13, positions up to 1e6.
GaussianModel Extreme() {
  GaussianModel model = CloudOf(kCount, 5);
  model.channels = 3;
  Random random(6);
  for (float& v : model.position)
    v *= static_cast<float>(std::pow(10.0, random.NextUniform(-6, 6)));
  for (float& v : model.log_scale) v = static_cast<float>(random.NextUniform(-18.0, 14.0));
  for (float& v : model.opacity_logit) v = static_cast<float>(random.NextUniform(-30.0, 30.0));
  model.sh_a.assign(kCount, 0.0f);
  model.sh_b.assign(kCount, 0.0f);
  for (int i = 0; i < kCount; ++i) {
    model.sh_a[i] = static_cast<float>(random.NextUniform(-5.0, 5.0));
    model.sh_b[i] = static_cast<float>(random.NextUniform(-5.0, 5.0));
  }
  model.rotation[0] = model.rotation[1] = model.rotation[2] = model.rotation[3] = 0.0f;
  return model;
}

// The ranges that SPZ can hold.
GaussianModel Large() {
  GaussianModel model = Extreme();
  Random random(7);
  for (float& v : model.log_scale) v = static_cast<float>(random.NextUniform(-9.9, 5.8));
  return model;
}

struct Numbers {
  std::vector<double> position, scale, opacity;
};

// Sorted, because formats reorder Gaussians: positions along x, scales, opacities.
Numbers SortedNumbers(const ViewerGaussians& g) {
  Numbers n;
  for (size_t i = 0; i < g.size(); ++i) {
    n.position.push_back(g.position[3 * i]);
    for (int k = 0; k < 3; ++k) n.scale.push_back(g.log_scale[3 * i + k]);
    n.opacity.push_back(1.0 / (1.0 + std::exp(-g.opacity_logit[i])));
  }
  for (std::vector<double>* values : {&n.position, &n.scale, &n.opacity}) {
    std::sort(values->begin(), values->end());
  }
  return n;
}

double LargestDifference(const std::vector<double>& x, const std::vector<double>& y) {
  double largest = 0.0;
  for (size_t i = 0; i < x.size(); ++i) largest = std::max(largest, std::abs(x[i] - y[i]));
  return largest;
}

using Writer = std::function<std::string(const GaussianModel&, const RgbHarmonics&, ThreadPool&)>;

// `bound`: of the error of log scales, absolute; of opacities, absolute; of positions, relative to
// the largest.
StabilityResult RunRoundTrip(const GaussianModel& model,
                             const Writer& write,
                             double bound,
                             ThreadPool& pool) {
  const RgbHarmonics rgb = FitRgbHarmonics(model, pool);
  const ViewerGaussians expected = ForViewers(model, rgb, ExportFrame(), pool);
  const ViewerGaussians found = ReadSplat(write(model, rgb, pool));
  StabilityResult r;
  r.condition = 1e12;
  r.condition_of = "positions, scales";
  for (const std::vector<float>* values :
       {&found.position, &found.log_scale, &found.rotation, &found.opacity_logit, &found.sh}) {
    r.non_finite += CountNonFinite(values->data(), values->size());
    r.compared += static_cast<int64_t>(values->size());
  }
  if (found.size() != expected.size()) {
    r.held = false;
    r.outcome = "another number of Gaussians";
    return r;
  }
  const Numbers x = SortedNumbers(found), y = SortedNumbers(expected);
  double furthest = 0.0;
  for (const float v : expected.position) furthest = std::max(furthest, 1.0 * std::abs(v));
  r.value_error = std::max({LargestDifference(x.position, y.position) / furthest,
                            LargestDifference(x.scale, y.scale),
                            LargestDifference(x.opacity, y.opacity)});
  r.value_bound = bound;
  return r;
}

}  // namespace

void AddFormatCases(std::vector<StabilityCase>& cases) {
  const Writer ply = [](const GaussianModel& model, const RgbHarmonics& rgb, ThreadPool& pool) {
    return EncodeGaussianPly(model, rgb, ExportFrame(), pool);
  };
  const Writer sog = [](const GaussianModel& model, const RgbHarmonics& rgb, ThreadPool& pool) {
    return EncodeSog(ForViewers(model, rgb, ExportFrame(), pool), pool);
  };
  const Writer spz = [](const GaussianModel& model, const RgbHarmonics& rgb, ThreadPool& pool) {
    return EncodeSpz(ForViewers(model, rgb, ExportFrame(), pool), SpzVersion::k4, pool);
  };
  const Writer glb = [](const GaussianModel& model, const RgbHarmonics& rgb, ThreadPool& pool) {
    return EncodeGlb(ForViewers(model, rgb, ExportFrame(), pool));
  };
  const Writer splat4d = [](const GaussianModel& model, const RgbHarmonics& rgb, ThreadPool& pool) {
    return EncodeSplat4d(model, rgb, ExportFrame(), 2, pool);
  };
  const auto round_trip =
      [&](const std::string& name, auto make, const Writer& write, double bound) {
        cases.push_back({"formats", name, false, [=](ThreadPool& pool) {
                           return RunRoundTrip(make(), write, bound, pool);
                         }});
      };
  round_trip("PLY, sizes of 10^14:1", Extreme, ply, 1e-7);
  // 256 levels of scale and opacity, 16 bits of the logarithm of the position.
  round_trip("SOG, sizes of 10^14:1", Extreme, sog, 32.0 / 255.0);
  // Sixteen steps per factor e, 8 bits of opacity.
  round_trip("SPZ, sizes of 10^6:1", Large, spz, 1.0 / 31.0);
  const auto refuse = [&](const std::string& name, const Writer& write, float value) {
    cases.push_back({"formats", name, false, [=](ThreadPool& pool) {
                       GaussianModel model = Large();
                       const RgbHarmonics rgb = FitRgbHarmonics(model, pool);
                       model.position[7] = value;
                       return MustRefuse({ErrorCode::kInvalidArgument},
                                         [&] { write(model, rgb, pool); });
                     }});
  };
  refuse("SOG, a position that is not a number", sog, kNan);
  refuse("SPZ, a position that is not a number", spz, kNan);
  refuse("GLB, a position that is not a number", glb, kNan);
  refuse("splat4d, a position that is not a number", splat4d, kNan);
  refuse("SPZ, a position of 1e30", spz, 1e30f);
}

}  // namespace color3d
