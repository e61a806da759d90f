#include "core/splat/geometry/densify.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace color3d {
namespace {

double Sigmoid(double x) { return 1.0 / (1.0 + std::exp(-x)); }
double Logit(double p) { return std::log(p / (1.0 - p)); }

double OpacityOf(const ParameterBlock& p, int64_t i) { return Sigmoid(p.Row(kOpacityRow)[i]); }

double LargestScale(const ParameterBlock& p, int64_t i) {
  return std::exp(
      std::max({p.Row(kLogScaleRow)[i], p.Row(kLogScaleRow + 1)[i], p.Row(kLogScaleRow + 2)[i]}));
}

double MeanGradient(const DensifyStatistics& s, int64_t i) {
  return s.count[i] > 0.0f ? s.gradient[i] / s.count[i] : 0.0;
}

void ForgetMoments(AdamMoments& moments, int64_t i) {
  for (int r = 0; r < moments.first.rows(); ++r) {
    moments.first.Row(r)[i] = 0.0f;
    moments.second.Row(r)[i] = 0.0f;
  }
}

void ResizeAll(DensifyTarget& t, int64_t count) {
  t.parameters.Resize(count);
  t.moments.first.Resize(count);
  t.moments.second.Resize(count);
}

// Moves Gaussian i by a sample of its own distribution.
void Jitter(ParameterBlock& p, int64_t i, Random& random) {
  double q[4], norm = 1e-24;
  for (int k = 0; k < 4; ++k) {
    q[k] = p.Row(kRotationRow + k)[i];
    norm += q[k] * q[k];
  }
  for (double& v : q) v /= std::sqrt(norm);
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  const double r[9] = {1 - 2 * (y * y + z * z),
                       2 * (x * y - w * z),
                       2 * (x * z + w * y),
                       2 * (x * y + w * z),
                       1 - 2 * (x * x + z * z),
                       2 * (y * z - w * x),
                       2 * (x * z - w * y),
                       2 * (y * z + w * x),
                       1 - 2 * (x * x + y * y)};
  double s[3];
  for (int k = 0; k < 3; ++k) s[k] = random.NextNormal() * std::exp(p.Row(kLogScaleRow + k)[i]);
  for (int k = 0; k < 3; ++k) {
    p.Row(kPositionRow + k)[i] +=
        static_cast<float>(r[3 * k] * s[0] + r[3 * k + 1] * s[1] + r[3 * k + 2] * s[2]);
  }
}

void Keep(const std::vector<uint32_t>& kept, DensifyTarget& t) {
  t.parameters.Gather(kept);
  t.moments.first.Gather(kept);
  t.moments.second.Gather(kept);
}

void Prune(const GradientDensifyOptions& options, DensifyTarget& t) {
  std::vector<uint32_t> kept;
  const ParameterBlock& p = t.parameters;
  for (int64_t i = 0; i < p.count(); ++i) {
    if (OpacityOf(p, i) >= options.prune_opacity && LargestScale(p, i) <= options.prune_scale) {
      kept.push_back(static_cast<uint32_t>(i));
    }
  }
  if (!kept.empty() && static_cast<int64_t>(kept.size()) < p.count()) Keep(kept, t);
}

}  // namespace

void DensifyByGradient(const GradientDensifyOptions& options, DensifyTarget& t) {
  const int64_t old_count = t.parameters.count();
  std::vector<uint32_t> chosen;
  for (int64_t i = 0; i < old_count; ++i) {
    const bool alive = OpacityOf(t.parameters, i) >= options.prune_opacity;
    if (alive && MeanGradient(t.statistics, i) >= options.gradient_threshold) {
      chosen.push_back(static_cast<uint32_t>(i));
    }
  }
  const int64_t room = std::max<int64_t>(0, options.max_gaussians - old_count);
  if (static_cast<int64_t>(chosen.size()) > room) {
    std::stable_sort(chosen.begin(), chosen.end(), [&](uint32_t a, uint32_t b) {
      return MeanGradient(t.statistics, a) > MeanGradient(t.statistics, b);
    });
    chosen.resize(room);
    std::sort(chosen.begin(), chosen.end());
  }
  ResizeAll(t, old_count + static_cast<int64_t>(chosen.size()));
  int64_t next = old_count;
  const float shrink = static_cast<float>(std::log(1.6));
  for (const uint32_t i : chosen) {
    t.parameters.CopyGaussian(i, next);
    if (LargestScale(t.parameters, i) > options.clone_below_scale) {
      for (const int64_t child : {static_cast<int64_t>(i), next}) {
        Jitter(t.parameters, child, t.random);
        for (int k = 0; k < 3; ++k) t.parameters.Row(kLogScaleRow + k)[child] -= shrink;
      }
      ForgetMoments(t.moments, i);
    }
    ++next;
  }
  Prune(options, t);
  t.statistics.Reset(t.parameters.count());
}

void KeepMostOpaque(int64_t count, DensifyTarget& t) {
  if (t.parameters.count() <= count) return;
  std::vector<uint32_t> kept(t.parameters.count());
  std::iota(kept.begin(), kept.end(), 0u);
  const float* logit = t.parameters.Row(kOpacityRow);
  std::stable_sort(
      kept.begin(), kept.end(), [&](uint32_t a, uint32_t b) { return logit[a] > logit[b]; });
  kept.resize(static_cast<size_t>(std::max<int64_t>(1, count)));
  std::sort(kept.begin(), kept.end());
  Keep(kept, t);
}

void ResetOpacity(double max_opacity, DensifyTarget& t) {
  const float cap = static_cast<float>(Logit(max_opacity));
  float* logit = t.parameters.Row(kOpacityRow);
  for (int64_t i = 0; i < t.parameters.count(); ++i) {
    logit[i] = std::min(logit[i], cap);
    t.moments.first.Row(kOpacityRow)[i] = 0.0f;
    t.moments.second.Row(kOpacityRow)[i] = 0.0f;
  }
}

}  // namespace color3d
