#include "core/splat/training/hexplane_penalties.h"

#include <cmath>
#include <vector>

namespace color3d {
namespace {

// Samples of one plane; `rows` along its second axis, `row` floats each, `step` floats a sample.
struct Plane {
  const float* value;
  float* gradient;
  int64_t rows;
  int64_t row;
  int64_t step;

  double Count() const { return static_cast<double>(rows * row); }
};

// Squared differences of values `step` floats apart within the floats [begin, end).
double AddDifferences(const Plane& p, double weight, int64_t begin, int64_t end, int64_t step) {
  double sum = 0.0;
  const auto scale = static_cast<float>(2.0 * weight);
  for (int64_t i = begin; i + step < end; ++i) {
    const float d = p.value[i + step] - p.value[i];
    sum += static_cast<double>(d) * d;
    p.gradient[i + step] += scale * d;
    p.gradient[i] -= scale * d;
  }
  return weight * sum;
}

// Both axes together.
double AddVariation(const Plane& p, double weight) {
  const double each = weight / p.Count();
  double sum = AddDifferences(p, each, 0, p.rows * p.row, p.row);
  for (int64_t r = 0; r < p.rows; ++r) {
    sum += AddDifferences(p, each, r * p.row, (r + 1) * p.row, p.step);
  }
  return sum;
}

// Second differences between rows, which are times.
double AddSmoothness(const Plane& p, double weight) {
  const double each = weight / p.Count();
  const auto scale = static_cast<float>(2.0 * each);
  double sum = 0.0;
  for (int64_t i = p.row; i < (p.rows - 1) * p.row; ++i) {
    const float d = p.value[i + p.row] - 2.0f * p.value[i] + p.value[i - p.row];
    sum += static_cast<double>(d) * d;
    p.gradient[i + p.row] += scale * d;
    p.gradient[i] -= 2.0f * scale * d;
    p.gradient[i - p.row] += scale * d;
  }
  return each * sum;
}

double AddDistanceFromOne(const Plane& p, double weight) {
  const double each = weight / p.Count();
  double sum = 0.0;
  for (int64_t i = 0; i < p.rows * p.row; ++i) {
    const float d = p.value[i] - 1.0f;
    sum += std::abs(static_cast<double>(d));
    if (d != 0.0f) p.gradient[i] += static_cast<float>(d > 0.0f ? each : -each);
  }
  return each * sum;
}

}  // namespace

double AddPlanePenalties(const HexPlaneShape& shape,
                         const HexPlaneTuning& tuning,
                         const float* planes,
                         ThreadPool& pool,
                         float* d_planes) {
  std::vector<double> sums(shape.levels.size() * kHexPlanes, 0.0);
  pool.ForEach(static_cast<int64_t>(sums.size()), [&](int64_t index, int) {
    const int level = static_cast<int>(index) / kHexPlanes;
    const int plane = static_cast<int>(index) % kHexPlanes;
    const size_t begin = shape.PlaneBegin(level, plane);
    const int second = kHexPlaneAxes[plane][1];
    Plane p;
    p.value = planes + begin;
    p.gradient = d_planes + begin;
    p.rows = shape.Samples(level, second);
    p.row = int64_t{shape.Samples(level, kHexPlaneAxes[plane][0])} * shape.features;
    p.step = shape.features;
    sums[static_cast<size_t>(index)] =
        second == kTimeAxis
            ? AddSmoothness(p, tuning.smoothness) + AddDistanceFromOne(p, tuning.time_change)
            : AddVariation(p, tuning.variation);
  });
  double total = 0.0;
  for (const double sum : sums) total += sum;
  return total;
}

}  // namespace color3d
