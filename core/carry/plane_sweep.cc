#include "core/carry/plane_sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "core/base/error.h"
#include "core/base/range_check.h"
#include "core/carry/plane_sweep_kernels.h"

namespace color3d {
namespace {

constexpr int kPlaneGroup = 16;  // planes whose costs are written to the volume together

// `mask` without the pixels whose census window reaches over its edge. Empty for null.
Image WholeWindows(const Image* mask) {
  if (mask == nullptr) return Image();
  Image whole = *mask;
  const cv::Mat plane(mask->height, mask->width, CV_32F, whole.data.data());
  constexpr int kSide = 2 * kCensusRadius + 1;
  cv::erode(plane, plane, cv::getStructuringElement(cv::MORPH_RECT, {kSide, kSide}));
  return whole;
}

// The homography through the plane at this depth of the reference camera, row-major, from pixels of
// the reference to those of the source.
std::array<float, 9> Homography(const PosedLuminance& reference,
                                const PosedLuminance& source,
                                double depth) {
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
  std::array<float, 9> h;
  Eigen::Map<Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(h.data()) =
      (k_source * (depth * rotation * from_pixel + translation * Eigen::RowVector3d(0, 0, 1)))
          .cast<float>();
  return h;
}

CostVolume MatchPlanes(const PosedLuminance& reference,
                       const std::vector<PosedLuminance>& sources,
                       const std::vector<double>& depths,
                       const CancellationToken& cancel) {
  const int width = reference.camera.width, height = reference.camera.height;
  const int planes = static_cast<int>(depths.size());
  CostVolume volume{width, height, planes, {}};
  volume.cost.resize(static_cast<size_t>(width) * height * planes);
  const CensusImage census = CensusOf(*reference.luminance, WholeWindows(reference.mask));
  std::vector<Image> source_masks;
  for (const PosedLuminance& source : sources) source_masks.push_back(WholeWindows(source.mask));
  const size_t count = sources.size();
  const int kept = static_cast<int>(count + 1) / 2;  // the best half: the others may be occluded
  std::vector<std::vector<uint8_t>> costs(count);
  std::vector<std::vector<uint8_t>> of_planes(kPlaneGroup);
  for (int first = 0; first < planes; first += kPlaneGroup) {
    const int in_group = std::min(kPlaneGroup, planes - first);
    for (int d = 0; d < in_group; ++d) {
      cancel.ThrowIfCancelled();
      for (size_t s = 0; s < count; ++s) {
        const std::array<float, 9> h = Homography(reference, sources[s], depths[first + d]);
        MatchSource(census, *sources[s].luminance, source_masks[s], h, &costs[s]);
      }
      MeanOfSmallest(costs, kept, &of_planes[d]);
    }
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const size_t at = static_cast<size_t>(y) * census.stride + x;
        uint8_t* out = volume.cost.data() + (static_cast<size_t>(y) * width + x) * planes + first;
        for (int d = 0; d < in_group; ++d) out[d] = of_planes[d][at];
      }
    }
  }
  return volume;
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
  const PathPenalties penalties{options.small_step, options.large_step, options.edge_contrast};
  std::vector<int16_t> sum(volume.cost.size());
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (dx == 0 && dy == 0) continue;
      cancel.ThrowIfCancelled();
      AddPathCosts(volume, *reference.luminance, penalties, dx, dy, sum);
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
