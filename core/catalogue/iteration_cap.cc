#include "core/catalogue/iteration_cap.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace color3d {
namespace {

// Chosen on training views of fern, banana, fox and sceaux
// (tests/bench/notes/2026-11-engine-and-service.md).
constexpr double kManyViews = 23.0;  // that need a whole schedule
constexpr double kMinShare = 2.0 / 3.0;
constexpr int kMinIterations = 1000;  // that few views are always allowed
constexpr int64_t kIterationsPerView = 150;
constexpr int64_t kMinLongSchedule = 1500;

}  // namespace

int IterationCap(int wanted, int training_views) {
  const double share = std::clamp(training_views / kManyViews, kMinShare, 1.0);
  const auto needed = std::max<int64_t>(kMinIterations, std::llround(share * wanted));
  const int64_t cap = std::max(kMinLongSchedule, kIterationsPerView * training_views);
  return static_cast<int>(std::min<int64_t>({wanted, needed, cap}));
}

}  // namespace color3d
