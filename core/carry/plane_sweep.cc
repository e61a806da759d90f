#include "core/carry/plane_sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <string>

#include "core/base/error.h"
#include "core/base/range_check.h"

namespace color3d {
namespace {

constexpr int kCensusRadius = 3;  // every second pixel of a 7x7 window
constexpr int kCensusBits = 24;
constexpr uint8_t kUnknownCost = 11;  // for pixels that a source does not show; about chance
constexpr int kCostScale = 8;         // fixed point of aggregated costs
constexpr size_t kBlock = 256;        // pixels whose costs are sorted together

using Census = std::vector<uint32_t>;

struct Offset {
  int x, y;
};

std::vector<Offset> CensusOffsets() {
  std::vector<Offset> offsets;
  for (int y = -kCensusRadius; y <= kCensusRadius; ++y) {
    for (int x = -kCensusRadius; x <= kCensusRadius; ++x) {
      if ((x + y) % 2 == 0 && (x != 0 || y != 0)) offsets.push_back({x, y});
    }
  }
  offsets.resize(kCensusBits);
  return offsets;
}

// One bit per offset: darker than the centre. Borders repeat the outermost pixels.
void ComputeCensus(const Image& picture, Census* census) {
  static const std::vector<Offset> offsets = CensusOffsets();
  const int width = picture.width, height = picture.height;
  census->assign(picture.PlaneSize(), 0);
  for (int y = 0; y < height; ++y) {
    const float* center = picture.data.data() + static_cast<size_t>(y) * width;
    uint32_t* out = census->data() + static_cast<size_t>(y) * width;
    for (int bit = 0; bit < kCensusBits; ++bit) {
      const int yy = std::clamp(y + offsets[bit].y, 0, height - 1);
      const float* row = picture.data.data() + static_cast<size_t>(yy) * width;
      const int dx = offsets[bit].x;
      const uint32_t mask = 1u << bit;
      const int begin = std::max(0, -dx), end = std::min(width, width - dx);
      for (int x = begin; x < end; ++x) out[x] |= row[x + dx] < center[x] ? mask : 0u;
      for (int x = 0; x < begin; ++x) out[x] |= row[0] < center[x] ? mask : 0u;
      for (int x = end; x < width; ++x) out[x] |= row[width - 1] < center[x] ? mask : 0u;
    }
  }
}

// Set bits of each of the lower 24, in a form that compilers vectorise without popcnt.
uint8_t CountBits(uint32_t x) {
  x = x - ((x >> 1) & 0x55555555u);
  x = (x & 0x33333333u) + ((x >> 2) & 0x33333333u);
  x = (x + (x >> 4)) & 0x0f0f0f0fu;
  return static_cast<uint8_t>(x + (x >> 8) + (x >> 16));
}

// Sums the `kept` smallest costs of the sources, for `count` pixels from `first` on. The cost of
// each source is inserted into the sorted ones, for all pixels of a block at once.
void SumSmallest(const std::vector<std::vector<uint8_t>>& costs,
                 size_t first,
                 size_t count,
                 size_t kept,
                 std::array<uint16_t, kBlock>* sums) {
  std::array<std::array<uint8_t, kBlock>, kMaxSweepSources> smallest;
  for (size_t k = 0; k < kept; ++k) smallest[k].fill(std::numeric_limits<uint8_t>::max());
  for (const std::vector<uint8_t>& of_source : costs) {
    std::array<uint8_t, kBlock> sinking;
    std::copy_n(of_source.data() + first, count, sinking.data());
    for (size_t k = 0; k < kept; ++k) {
      for (size_t i = 0; i < count; ++i) {
        const uint8_t least = std::min(smallest[k][i], sinking[i]);
        sinking[i] = std::max(smallest[k][i], sinking[i]);
        smallest[k][i] = least;
      }
    }
  }
  sums->fill(0);
  for (size_t k = 0; k < kept; ++k) {
    for (size_t i = 0; i < count; ++i) (*sums)[i] += smallest[k][i];
  }
}

// `mask` without the pixels whose census window reaches over its edge. Empty for null.
Image WholeWindows(const Image* mask) {
  if (mask == nullptr) return Image();
  Image whole = *mask;
  const cv::Mat plane(mask->height, mask->width, CV_32F, whole.data.data());
  constexpr int kSide = 2 * kCensusRadius + 1;
  cv::erode(plane, plane, cv::getStructuringElement(cv::MORPH_RECT, {kSide, kSide}));
  return whole;
}

// Warps the source through the plane at this depth of the reference camera. `valid` is 0 outside
// the source and where `source_mask` (may be empty) is 0.
void WarpThroughPlane(const PosedLuminance& reference,
                      const PosedLuminance& source,
                      const Image& source_mask,
                      double depth,
                      Image* warped,
                      std::vector<uint8_t>* valid) {
  const Camera& r = reference.camera;
  const Camera& s = source.camera;
  const Eigen::Matrix3d rotation =
      (source.cam_from_world.rotation * reference.cam_from_world.rotation.conjugate())
          .toRotationMatrix();
  const Eigen::Vector3d translation =
      source.cam_from_world.Apply(reference.cam_from_world.Center());
  Eigen::Matrix3d k_source, from_pixel;
  k_source << s.fx, 0, s.cx, 0, s.fy, s.cy, 0, 0, 1;
  from_pixel << 1 / r.fx, 0, -r.cx / r.fx, 0, 1 / r.fy, -r.cy / r.fy, 0, 0, 1;
  const Eigen::Matrix3f h =
      (k_source * (depth * rotation * from_pixel + translation * Eigen::RowVector3d(0, 0, 1)))
          .cast<float>();
  const Image& picture = *source.luminance;
  const int width = r.width, height = r.height;
  const float max_x = static_cast<float>(picture.width - 1);
  const float max_y = static_cast<float>(picture.height - 1);
  std::vector<float> column(width), row(width);
  for (int y = 0; y < height; ++y) {
    float* out = warped->data.data() + static_cast<size_t>(y) * width;
    uint8_t* ok = valid->data() + static_cast<size_t>(y) * width;
    const float py = y + 0.5f;
    // Positions of the pixels of a row, in a loop apart from the sampling, which compilers
    // vectorise.
    for (int x = 0; x < width; ++x) {
      const float px = x + 0.5f;
      const float w = h(2, 0) * px + h(2, 1) * py + h(2, 2);
      const float inverse = 1.0f / std::max(w, 1e-6f);
      const float sx = (h(0, 0) * px + h(0, 1) * py + h(0, 2)) * inverse - 0.5f;
      const float sy = (h(1, 0) * px + h(1, 1) * py + h(1, 2)) * inverse - 0.5f;
      const bool inside = (w > 1e-6f) & (sx >= 0.0f) & (sy >= 0.0f) & (sx <= max_x) & (sy <= max_y);
      ok[x] = inside;
      column[x] = inside ? sx : 0.0f;
      row[x] = inside ? sy : 0.0f;
    }
    for (int x = 0; x < width && !source_mask.Empty(); ++x) {
      const int sx = static_cast<int>(column[x] + 0.5f), sy = static_cast<int>(row[x] + 0.5f);
      if (source_mask.At(0, sy, sx) == 0.0f) ok[x] = 0;
    }
    for (int x = 0; x < width; ++x) {
      const int x0 = std::min(static_cast<int>(column[x]), picture.width - 2);
      const int y0 = std::min(static_cast<int>(row[x]), picture.height - 2);
      const float tx = column[x] - x0, ty = row[x] - y0;
      const float* p = picture.data.data() + static_cast<size_t>(y0) * picture.width + x0;
      const float top = p[0] + tx * (p[1] - p[0]);
      const float bottom = p[picture.width] + tx * (p[picture.width + 1] - p[picture.width]);
      out[x] = top + ty * (bottom - top);
    }
  }
}

// Costs of all planes at all pixels, 0..kCensusBits in fixed point, [pixel][plane].
struct CostVolume {
  int width, height, planes;
  std::vector<int16_t> cost;
};

CostVolume MatchPlanes(const PosedLuminance& reference,
                       const std::vector<PosedLuminance>& sources,
                       const std::vector<double>& depths,
                       const CancellationToken& cancel) {
  const int width = reference.camera.width, height = reference.camera.height;
  const int planes = static_cast<int>(depths.size());
  const size_t pixels = static_cast<size_t>(width) * height;
  CostVolume volume{width, height, planes, std::vector<int16_t>(pixels * planes)};
  Census of_reference, of_warped;
  ComputeCensus(*reference.luminance, &of_reference);
  Image warped(width, height, 1);
  std::vector<uint8_t> valid(pixels);
  const Image reference_mask = WholeWindows(reference.mask);
  std::vector<Image> source_masks;
  for (const PosedLuminance& source : sources) source_masks.push_back(WholeWindows(source.mask));
  const size_t count = sources.size();
  const size_t kept = (count + 1) / 2;  // the best half: the others may be occluded
  std::vector<std::vector<uint8_t>> costs(count, std::vector<uint8_t>(pixels));
  for (int d = 0; d < planes; ++d) {
    cancel.ThrowIfCancelled();
    for (size_t s = 0; s < count; ++s) {
      WarpThroughPlane(reference, sources[s], source_masks[s], depths[d], &warped, &valid);
      ComputeCensus(warped, &of_warped);
      for (size_t i = 0; i < reference_mask.data.size(); ++i) {
        if (reference_mask.data[i] == 0.0f) valid[i] = 0;
      }
      for (size_t i = 0; i < pixels; ++i) {
        const uint8_t bits = CountBits(of_reference[i] ^ of_warped[i]);
        costs[s][i] = valid[i] ? bits : kUnknownCost;
      }
    }
    for (size_t first = 0; first < pixels; first += kBlock) {
      const size_t in_block = std::min(kBlock, pixels - first);
      std::array<uint16_t, kBlock> sums;
      SumSmallest(costs, first, in_block, kept, &sums);
      for (size_t i = 0; i < in_block; ++i) {
        volume.cost[(first + i) * planes + d] =
            static_cast<int16_t>(sums[i] * kCostScale / static_cast<int>(kept));
      }
    }
  }
  return volume;
}

// Costs of the paths that arrive at the previous pixel, and of changing the plane after it.
struct PathCosts {
  const int16_t* paths;  // per plane; [-1] and [planes] are padding with a high cost
  int16_t least;
  int16_t small_step;
  int16_t large_step;
};

// One step of semi-global matching: best cost of a path that arrives at a pixel, per plane.
void PathStep(const int16_t* cost, PathCosts previous, int planes, int16_t* out, int16_t* sum) {
  const int16_t jump = static_cast<int16_t>(previous.least + previous.large_step);
  for (int d = 0; d < planes; ++d) {
    const int16_t* path = previous.paths + d;
    int16_t best = std::min(*path, jump);
    best = std::min<int16_t>(best, static_cast<int16_t>(path[-1] + previous.small_step));
    best = std::min<int16_t>(best, static_cast<int16_t>(path[1] + previous.small_step));
    const auto value = static_cast<int16_t>(cost[d] + best - previous.least);
    out[d] = value;
    sum[d] = static_cast<int16_t>(sum[d] + value);
  }
}

// Adds one direction's path costs to `sum`.
void AggregateDirection(const CostVolume& volume,
                        const Image& luminance,
                        const PlaneSweepOptions& options,
                        int dx,
                        int dy,
                        std::vector<int16_t>& sum) {
  const int width = volume.width, height = volume.height, planes = volume.planes;
  const int stride = planes + 2;
  constexpr int16_t kHigh = 8000;
  const auto small_step = static_cast<int16_t>(options.small_step * kCostScale);
  std::vector<int16_t> rows[2];
  std::vector<int16_t> least[2];
  for (int i = 0; i < 2; ++i) {
    rows[i].assign(static_cast<size_t>(width) * stride, kHigh);
    least[i].assign(width, 0);
  }
  const int first_y = dy < 0 ? height - 1 : 0, step_y = dy < 0 ? -1 : 1;
  const bool backwards = dx < 0 || (dx == 0 && dy < 0);
  for (int n = 0; n < height; ++n) {
    const int y = first_y + n * step_y;
    auto& current = rows[n & 1];
    auto& current_least = least[n & 1];
    const auto& above = dy == 0 ? current : rows[1 - (n & 1)];
    const auto& above_least = dy == 0 ? current_least : least[1 - (n & 1)];
    for (int m = 0; m < width; ++m) {
      const int x = backwards ? width - 1 - m : m;
      const size_t pixel = static_cast<size_t>(y) * width + x;
      const int16_t* cost = volume.cost.data() + pixel * planes;
      int16_t* out = current.data() + static_cast<size_t>(x) * stride + 1;
      int16_t* total = sum.data() + pixel * planes;
      const int px = x - dx, py = y - dy;
      if (px < 0 || px >= width || py < 0 || py >= height) {
        for (int d = 0; d < planes; ++d) {
          out[d] = cost[d];
          total[d] = static_cast<int16_t>(total[d] + cost[d]);
        }
      } else {
        const double contrast = std::abs(luminance.At(0, y, x) - luminance.At(0, py, px));
        const double large = options.large_step / (1.0 + contrast / options.edge_contrast);
        const auto large_step = static_cast<int16_t>(
            kCostScale * std::max(large, options.small_step + 1.0 / kCostScale));
        const int16_t* paths = above.data() + static_cast<size_t>(px) * stride + 1;
        PathStep(cost, {paths, above_least[px], small_step, large_step}, planes, out, total);
      }
      int16_t smallest = out[0];
      for (int d = 1; d < planes; ++d) smallest = std::min(smallest, out[d]);
      current_least[x] = smallest;
    }
  }
}

// Best plane, refined by a parabola through its neighbours.
double PickPlane(const int16_t* sum, int planes) {
  const int best = static_cast<int>(std::min_element(sum, sum + planes) - sum);
  if (best == 0 || best + 1 == planes) return best;
  const double low = sum[best - 1] - sum[best], high = sum[best + 1] - sum[best];
  return low + high > 0 ? best + 0.5 * (low - high) / (low + high) : best;
}

}  // namespace

void PlaneSweepOptions::Validate() const {
  RangeCheck("plane sweep option")("planes", planes, 8, 512);
}

Image SweepPlanes(const PosedLuminance& reference,
                  const std::vector<PosedLuminance>& sources,
                  double nearest,
                  double farthest,
                  const PlaneSweepOptions& options,
                  const CancellationToken& cancel) {
  options.Validate();
  if (sources.empty() || static_cast<int>(sources.size()) > kMaxSweepSources) {
    throw InvalidArgument(
        "the plane sweep takes 1 to {} sources, but got {}", kMaxSweepSources, sources.size());
  }
  if (!(nearest > 0.0 && farthest > nearest && std::isfinite(farthest))) {
    throw InvalidArgument(
        "the depth range {} to {} of the plane sweep is empty", nearest, farthest);
  }
  const auto depth_of = [&](double plane) {
    const double t = plane / (options.planes - 1.0);
    return 1.0 / ((1.0 - t) / farthest + t / nearest);
  };
  std::vector<double> depths(options.planes);
  for (int d = 0; d < options.planes; ++d) depths[d] = depth_of(d);
  const CostVolume volume = MatchPlanes(reference, sources, depths, cancel);
  std::vector<int16_t> sum(volume.cost.size());
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (dx == 0 && dy == 0) continue;
      cancel.ThrowIfCancelled();
      AggregateDirection(volume, *reference.luminance, options, dx, dy, sum);
    }
  }
  Image depth(volume.width, volume.height, 1);
  for (size_t i = 0; i < depth.data.size(); ++i) {
    depth.data[i] =
        static_cast<float>(depth_of(PickPlane(sum.data() + i * options.planes, options.planes)));
  }
  return depth;
}

}  // namespace color3d
