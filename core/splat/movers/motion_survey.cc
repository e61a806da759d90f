#include "core/splat/movers/motion_survey.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "core/base/evenly.h"
#include "core/base/median.h"
#include "core/image/box_mean.h"

namespace color3d {
namespace {

constexpr int kRadiusPx = 2;
constexpr double kDeviations = 5.0;
constexpr double kLeastResidual = 0.03;
constexpr size_t kMedianFrames = 31;  // at most, evenly over time
constexpr size_t kFewestFrames = 5;   // for a median over time
constexpr int kSpeckPixels = 6;       // minimum of moving pixels among 3x3
constexpr double kConfirmed = 0.1;    // minimum share of known moving pixels with high residuals
// Maximum shares of such pixels in static scenes: with a median over time or known moving regions,
// and with neither, where badly drawn regions look like motion.
constexpr double kStillShare = 0.002;
constexpr double kStillShareAlone = 0.005;
constexpr size_t kNoiseStep = 7;  // every 7th pixel is sampled for the standard deviation

using PoseKey = std::tuple<double, double, double, double, double, double, double, int, int>;

// Views with equal pose and size belong to a static camera.
PoseKey MakePoseKey(const PosedCamera& p) {
  const Eigen::Quaterniond& q = p.cam_from_world.rotation;
  const Eigen::Vector3d& t = p.cam_from_world.translation;
  return {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z(), p.camera.width, p.camera.height};
}

Image ResidualOf(const SurveyedView& view) {
  Image residual = view.luminance;
  for (size_t i = 0; i < residual.data.size(); ++i) residual.data[i] -= view.drawn.data[i];
  return BoxMean(residual, kRadiusPx);
}

// Subtracts the median over time, pixel by pixel.
void SubtractTemporalMedian(const std::vector<size_t>& frames,
                            ThreadPool& pool,
                            std::vector<Image>& residuals) {
  const std::vector<size_t> some = PickEvenly(frames, kMedianFrames);
  const auto pixels = static_cast<int64_t>(residuals[frames.front()].data.size());
  pool.ForRanges(pixels, [&](int64_t begin, int64_t end, int) {
    std::vector<double> values(some.size());
    for (int64_t i = begin; i < end; ++i) {
      for (size_t k = 0; k < some.size(); ++k) values[k] = residuals[some[k]].data[i];
      const auto median = static_cast<float>(Median(values));
      for (const size_t frame : frames) residuals[frame].data[i] -= median;
    }
  });
}

double DeviationOf(const std::vector<Image>& residuals) {
  std::vector<double> sizes;
  for (const Image& residual : residuals) {
    for (size_t i = 0; i < residual.data.size(); i += kNoiseStep) {
      sizes.push_back(std::abs(residual.data[i]));
    }
  }
  return sizes.empty() ? 0.0 : 1.4826 * Median(std::move(sizes));
}

Image MaskOf(const Image& residual, double threshold) {
  Image mask(residual.width, residual.height, 1);
  for (size_t i = 0; i < residual.data.size(); ++i) {
    mask.data[i] = std::abs(residual.data[i]) > threshold ? 1.0f : 0.0f;
  }
  const Image around = BoxMean(mask, 1);
  for (size_t i = 0; i < mask.data.size(); ++i) {
    if (around.data[i] * 9.0f < static_cast<float>(kSpeckPixels) - 0.5f) mask.data[i] = 0.0f;
  }
  return mask;
}

// Pixels where motion was detected before training.
void AddKnownMotion(SurveyedView& view) {
  for (size_t i = 0; i < view.still.data.size(); ++i) {
    if (view.still.data[i] == 0.0f) view.moving.data[i] = 1.0f;
  }
}

// Returns true if the previously detected moving pixels have high residuals; otherwise they are
// static.
bool IsMotionConfirmed(const std::vector<SurveyedView>& views) {
  double seen = 0.0, confirmed = 0.0;
  for (const SurveyedView& view : views) {
    for (size_t i = 0; i < view.still.data.size(); ++i) {
      if (view.still.data[i] > 0.0f) continue;
      seen += 1.0;
      confirmed += view.moving.data[i];
    }
  }
  return confirmed > kConfirmed * seen;
}

double Sum(const Image& image) {
  double sum = 0.0;
  for (const float v : image.data) sum += v;
  return sum;
}

}  // namespace

MotionSurvey SurveyMotion(ThreadPool& pool, std::vector<SurveyedView>& views) {
  MotionSurvey survey;
  bool one_time = true;
  for (const SurveyedView& view : views) {
    one_time = one_time && view.posed.time_s == views.front().posed.time_s;
  }
  std::vector<Image> residuals(views.size());
  pool.ForEach(static_cast<int64_t>(views.size()),
               [&](int64_t i, int) { residuals[i] = ResidualOf(views[i]); });
  std::map<PoseKey, std::vector<size_t>> cameras;
  for (size_t i = 0; i < views.size(); ++i) cameras[MakePoseKey(views[i].posed)].push_back(i);
  bool has_median = false;
  for (const auto& [camera, frames] : cameras) {
    if (frames.size() < kFewestFrames) continue;
    has_median = true;
    SubtractTemporalMedian(frames, pool, residuals);
  }
  survey.threshold = std::max(kLeastResidual, kDeviations * DeviationOf(residuals));
  double residual = 0.0, moving = 0.0, pixels = 0.0;
  for (size_t i = 0; i < views.size(); ++i) {
    views[i].moving = one_time ? Image(residuals[i].width, residuals[i].height, 1)
                               : MaskOf(residuals[i], survey.threshold);
    residual += Sum(views[i].moving);
  }
  const bool seen = !one_time && IsMotionConfirmed(views);
  survey.least_share = has_median || seen ? kStillShare : kStillShareAlone;
  for (SurveyedView& view : views) {
    if (seen) AddKnownMotion(view);
    moving += Sum(view.moving);
    pixels += static_cast<double>(view.moving.data.size());
  }
  if (pixels == 0.0) return survey;
  survey.residual_share = residual / pixels;
  survey.moving_share = moving / pixels;
  return survey;
}

}  // namespace color3d
