#include "tests/stability/raster_compare.h"

#include <algorithm>
#include <cmath>

#include "core/base/random.h"

namespace color3d {
namespace {

constexpr float kBackground[3] = {0.2f, 0.5f, 0.6f};
// Denominator for buffers of zeros: far below the eps of Adam, 1e-15.
constexpr double kVanishing = 1e-20;

// Largest |fast - reference| and |reference| of a buffer.
struct Worst {
  double difference = 0.0;
  double scale = 0.0;
  void Add(double fast, double reference) {
    const double d = std::abs(fast - reference);
    difference = std::isnan(d) ? std::numeric_limits<double>::infinity() : std::max(difference, d);
    scale = std::max(scale, std::abs(reference));
  }
  double Relative(double least_scale) const {
    return difference / std::max({scale, least_scale, kVanishing});
  }
};

std::vector<ReferencePixel> Sample(const RasterCamera& camera, int most) {
  const int64_t pixels = static_cast<int64_t>(camera.width) * camera.height;
  const int64_t count = std::min<int64_t>(pixels, most);
  std::vector<ReferencePixel> sample(count);
  for (int64_t k = 0; k < count; ++k) {
    const int64_t at = k * pixels / count;
    sample[k].x = static_cast<int>(at % camera.width);
    sample[k].y = static_cast<int>(at / camera.width);
  }
  return sample;
}

double ValueError(const SplatPipeline& pipeline,
                  int channels,
                  const std::vector<ReferencePixel>& pixels) {
  Worst color[3], opacity, depth;
  for (const ReferencePixel& p : pixels) {
    for (int c = 0; c < channels; ++c) color[c].Add(pipeline.color().Row(c, p.y)[p.x], p.color[c]);
    opacity.Add(1.0 - pipeline.transmittance().Row(0, p.y)[p.x], p.opacity);
    depth.Add(pipeline.color().Row(channels, p.y)[p.x], p.depth);
  }
  // Opacity is 1 - T in the kernels, so its error is relative to 1.
  double worst = std::max(opacity.Relative(1.0), depth.Relative(0.0));
  for (int c = 0; c < channels; ++c) worst = std::max(worst, color[c].Relative(0.0));
  return worst;
}

int GroupOf(int row) {
  if (row < kLogScaleRow) return 0;
  if (row < kOpacityRow) return 1;
  return row < kColorRow ? 2 : 3;
}

double QuaternionNorm(const ReferenceParameters& p, int i) {
  double norm2 = 1e-24;
  for (int k = 0; k < 4; ++k) norm2 += p.At(kRotationRow + k, i) * p.At(kRotationRow + k, i);
  return std::sqrt(norm2);
}

double GradientError(const ReferenceParameters& parameters,
                     const ParameterBlock& fast,
                     const ReferenceParameters& reference) {
  std::vector<Worst> rows(reference.rows);
  double group_scale[4] = {};
  for (int row = 0; row < reference.rows; ++row) {
    const bool rotation = row >= kRotationRow && row < kOpacityRow;
    for (int i = 0; i < reference.count; ++i) {
      const double factor = rotation ? QuaternionNorm(parameters, i) : 1.0;
      rows[row].Add(factor * fast.Row(row)[i], factor * reference.At(row, i));
    }
    double& scale = group_scale[GroupOf(row)];
    scale = std::max(scale, rows[row].scale);
  }
  double worst = 0.0;
  for (int row = 0; row < reference.rows; ++row) {
    worst = std::max(worst, rows[row].Relative(1e-3 * group_scale[GroupOf(row)]));
  }
  return worst;
}

// Random weights of the pixels, for both renderers.
void MakeAdjoint(const std::vector<ReferencePixel>& pixels,
                 int channels,
                 PlaneBuffer& planes,
                 std::vector<std::array<double, 3>>& list) {
  Random random(99);
  list.assign(pixels.size(), {});
  for (size_t k = 0; k < pixels.size(); ++k) {
    for (int c = 0; c < channels; ++c) {
      const float weight = static_cast<float>(random.NextUniform(-1.0, 1.0));
      planes.Row(c, pixels[k].y)[pixels[k].x] = weight;
      list[k][c] = weight;
    }
  }
}

int64_t NonFinite(const AlignedFloats& values) {
  return CountNonFinite(values.data(), values.size());
}

}  // namespace

StabilityResult CompareRaster(const RasterCase& raster_case, ThreadPool& pool) {
  const RasterCase& r = raster_case;
  const ReferenceParameters truth = r.truth ? *r.truth : ReferenceParameters::From(r.parameters);
  const RasterCamera camera = r.truth_camera ? *r.truth_camera : r.camera;
  const std::vector<double> background(kBackground, kBackground + 3);
  StabilityResult result;
  result.value_bound = r.value_bound;
  result.gradient_bound = r.gradient_bound;
  result.condition_of = r.condition_of;
  result.condition = r.condition > 0.0 ? r.condition : ReferenceCovarianceCondition(truth, camera);

  std::vector<ReferencePixel> pixels = Sample(camera, r.max_pixels);
  ReferenceRenderAt(truth, r.color, camera, background, r.threshold_margin, pixels);
  const size_t sampled = pixels.size();
  std::erase_if(pixels, [](const ReferencePixel& p) { return p.near_threshold; });
  result.compared = static_cast<int64_t>(pixels.size());
  result.left_out = static_cast<int64_t>(sampled - pixels.size());

  SplatPipeline pipeline;
  pipeline.Forward({r.parameters, r.color, r.camera}, kBackground, true, pool);
  result.value_error = ValueError(pipeline, r.color.channels, pixels);
  result.non_finite = NonFinite(pipeline.color().data) + NonFinite(pipeline.transmittance().data);

  PlaneBuffer adjoint(r.camera.width, r.camera.height, r.color.channels);
  std::vector<std::array<double, 3>> adjoint_list;
  MakeAdjoint(pixels, r.color.channels, adjoint, adjoint_list);
  ParameterBlock gradient;
  DensifyStatistics statistics;
  statistics.Reset(r.parameters.count());
  pipeline.Forward({r.parameters, r.color, r.camera}, kBackground, false, pool);
  pipeline.Backward({r.parameters, r.color, r.camera},
                    adjoint,
                    pool,
                    {GradientScope::kAll, gradient, &statistics});
  result.gradient_error = GradientError(
      truth, gradient, ReferenceGradient(truth, r.color, camera, background, pixels, adjoint_list));
  result.non_finite += NonFinite(gradient.values()) + NonFinite(statistics.gradient) +
                       NonFinite(statistics.count) + NonFinite(statistics.radius);
  return result;
}

}  // namespace color3d
