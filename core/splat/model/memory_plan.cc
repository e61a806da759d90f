#include "core/splat/model/memory_plan.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {
namespace {

constexpr int64_t kMiB = int64_t{1} << 20;
constexpr int64_t kProgramBytes = 96 * kMiB;  // code, libraries, scene, stacks
constexpr int64_t kBytesPerPair = 42;
constexpr int64_t kPairsPerGaussian = 8;
constexpr int64_t kPairsPerTile = 400;
constexpr int64_t kTilePx = 256;
constexpr int64_t kWorkBytesPerPixel =
    80;  // of a channel: pictures, gradients and filtered moments of the loss
constexpr int64_t kPhotoBytesPerPixel = 36;  // decoded (3 x 16 bit), as float, turned, undistorted
// Maximum caches of training pictures and of decoded ones.
constexpr int64_t kTargetCacheBytes = 512 * kMiB;
constexpr int64_t kImageCacheBytes = 1024 * kMiB;
constexpr int64_t kFrameTargetCacheBytes = 128 * kMiB;  // of dynamic scenes
constexpr int64_t kFrameCacheBytes = 32 * kMiB;
constexpr int64_t kSurveyBytes = 80 * kMiB;  // of the motion survey
constexpr int kSmallestSidePx = 64;
constexpr double kSideStep = 0.85;
constexpr int64_t kFewestGaussians = 1000;

int64_t Pixels(const Camera& camera) { return int64_t{camera.width} * camera.height; }

struct PixelCounts {
  int64_t largest = 0;
  int64_t all = 0;
};

PixelCounts WorkingPixels(const MemoryDemand& demand, int side) {
  PixelCounts counts;
  for (const MemoryDemand::View& view : demand.views) {
    const int64_t pixels = Pixels(view.camera.FitWithin(side));
    counts.largest = std::max(counts.largest, pixels);
    counts.all += pixels;
  }
  return counts;
}

int64_t PhotoBytes(const MemoryDemand& demand) {
  int64_t most = 0;
  for (const MemoryDemand::View& view : demand.views) {
    most = std::max(most, kPhotoBytesPerPixel * Pixels(view.captured));
  }
  return most;
}

int64_t TargetCacheBytes(const MemoryDemand& demand) {
  return demand.moves ? kFrameTargetCacheBytes : kTargetCacheBytes;
}

// Everything but the Gaussians.
int64_t FixedBytes(const MemoryDemand& demand, int side) {
  const PixelCounts px = WorkingPixels(demand, side);
  // The trainer keeps pictures at two sizes (4 + 1 bytes a pixel) within its own budget.
  return kProgramBytes + PhotoBytes(demand) + demand.channels * kWorkBytesPerPixel * px.largest +
         std::min(TargetCacheBytes(demand), (4 * demand.channels + 1) * px.all) +
         (demand.moves ? kSurveyBytes : 0) + demand.deformation_bytes +
         kBytesPerPair * kPairsPerTile * (px.largest / kTilePx + 1);
}

int64_t BytesWithPairs(const MemoryDemand& demand) {
  return BytesPerGaussian(demand.sh_degree, demand.channels) + kBytesPerPair * kPairsPerGaussian;
}

std::string MiB(int64_t bytes) { return fmt::format("{} MiB", (bytes + kMiB - 1) / kMiB); }

void ThrowTooLarge(const MemoryDemand& demand, int64_t budget) {
  const int64_t needed = GeometryBytes(demand, kSmallestSidePx, static_cast<int>(kFewestGaussians));
  std::string photo;
  for (const MemoryDemand::View& view : demand.views) {
    if (photo.empty() && 2 * kPhotoBytesPerPixel * Pixels(view.captured) > needed) {
      photo = fmt::format(
          ", most of it for a photo of {} x {} px", view.captured.width, view.captured.height);
    }
  }
  throw Error(
      ErrorCode::kResourceExhausted,
      "reconstruction needs at least {} of memory{}, and {} may be used; free memory or give "
      "smaller photos",
      MiB(needed),
      photo,
      MiB(budget));
}

}  // namespace

int64_t BytesPerGaussian(int sh_degree, int channels) {
  return 4 * (11 * (11 + int64_t{channels} * ShCoefficients(sh_degree)) + 32);
}

int64_t GeometryBytes(const MemoryDemand& demand, int max_side_px, int max_gaussians) {
  return FixedBytes(demand, max_side_px) + max_gaussians * BytesWithPairs(demand);
}

MemoryPlan PlanGeometryMemory(const MemoryDemand& demand, int64_t budget_bytes) {
  MemoryPlan plan;
  plan.budget_bytes = budget_bytes;
  const int64_t fewest = std::min<int64_t>(
      demand.max_gaussians, std::max<int64_t>(kFewestGaussians, demand.max_gaussians / 4));
  for (int side = demand.max_side_px;; side = static_cast<int>(side * kSideStep)) {
    const bool last = side <= kSmallestSidePx;
    const int64_t left = budget_bytes - FixedBytes(demand, side);
    const int64_t fits = std::max<int64_t>(0, left) / BytesWithPairs(demand);
    const int64_t enough = last ? std::min(fewest, kFewestGaussians) : fewest;
    if (fits < enough) {
      if (last) ThrowTooLarge(demand, budget_bytes);
      continue;
    }
    plan.max_side_px = side;
    plan.max_gaussians = static_cast<int>(std::min<int64_t>(fits, demand.max_gaussians));
    break;
  }
  const int64_t least = GeometryBytes(demand, plan.max_side_px, plan.max_gaussians);
  plan.target_cache_bytes = TargetCacheBytes(demand);
  plan.image_cache_bytes = std::min({demand.moves ? kFrameCacheBytes : kImageCacheBytes,
                                     4 * WorkingPixels(demand, plan.max_side_px).all,
                                     std::max<int64_t>(0, budget_bytes - least)});
  plan.estimated_bytes = least + plan.image_cache_bytes;
  if (plan.max_side_px != demand.max_side_px || plan.max_gaussians != demand.max_gaussians) {
    plan.note = fmt::format(
        "memory: {} may be used where {} are wanted; reconstruction works at {} px instead of {} "
        "with at most {} Gaussians instead of {}",
        MiB(budget_bytes),
        MiB(GeometryBytes(demand, demand.max_side_px, demand.max_gaussians)),
        plan.max_side_px,
        demand.max_side_px,
        plan.max_gaussians,
        demand.max_gaussians);
  }
  return plan;
}

}  // namespace color3d
