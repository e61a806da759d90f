#include "core/splat/model/memory_plan.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/catalogue/memory_model.h"

namespace color3d {
namespace {

constexpr int64_t kMiB = int64_t{1} << 20;
constexpr int64_t kImageCacheBytes = 1024 * kMiB;  // maximum cache of decoded pictures
constexpr int64_t kFrameCacheBytes = 32 * kMiB;    // of dynamic scenes
constexpr int kSmallestSidePx = 64;
constexpr double kSideStep = 0.85;
constexpr int64_t kFewestGaussians = 1000;

int64_t Pixels(const Camera& camera) { return int64_t{camera.width} * camera.height; }

GeometryMemory MemoryOf(const MemoryDemand& demand, int side, int64_t gaussians) {
  GeometryMemory memory{.gaussians = gaussians,
                        .sh_degree = demand.sh_degree,
                        .channels = demand.channels,
                        .moves = demand.moves,
                        .deformation_bytes = demand.deformation_bytes};
  for (const MemoryDemand::View& view : demand.views) {
    const int64_t pixels = Pixels(view.camera.FitWithin(side));
    memory.largest_photo_px = std::max(memory.largest_photo_px, Pixels(view.captured));
    memory.largest_picture_px = std::max(memory.largest_picture_px, pixels);
    memory.all_pictures_px += pixels;
  }
  return memory;
}

std::string MiB(int64_t bytes) { return fmt::format("{} MiB", (bytes + kMiB - 1) / kMiB); }

void ThrowTooLarge(const MemoryDemand& demand, int64_t budget) {
  const int64_t needed = GeometryBytes(demand, kSmallestSidePx, static_cast<int>(kFewestGaussians));
  std::string photo;
  for (const MemoryDemand::View& view : demand.views) {
    if (photo.empty() && 2 * PhotoBytes(Pixels(view.captured)) > needed) {
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

int64_t GeometryBytes(const MemoryDemand& demand, int max_side_px, int max_gaussians) {
  return GeometryBytes(MemoryOf(demand, max_side_px, max_gaussians));
}

MemoryPlan PlanGeometryMemory(const MemoryDemand& demand, int64_t budget_bytes) {
  MemoryPlan plan;
  plan.budget_bytes = budget_bytes;
  const int64_t fewest = std::min<int64_t>(
      demand.max_gaussians, std::max<int64_t>(kFewestGaussians, demand.max_gaussians / 4));
  for (int side = demand.max_side_px;; side = static_cast<int>(side * kSideStep)) {
    const bool last = side <= kSmallestSidePx;
    const int64_t left = budget_bytes - GeometryBytes(demand, side, 0);
    const int64_t fits =
        std::max<int64_t>(0, left) / BytesPerGaussianWithPairs(demand.sh_degree, demand.channels);
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
  plan.target_cache_bytes = TargetCacheBytes(demand.moves);
  plan.image_cache_bytes = std::min({demand.moves ? kFrameCacheBytes : kImageCacheBytes,
                                     4 * MemoryOf(demand, plan.max_side_px, 0).all_pictures_px,
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
