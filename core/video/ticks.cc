#include "core/video/ticks.h"

extern "C" {
#include <libavutil/rational.h>
}

#include <algorithm>
#include <cmath>

namespace color3d {
namespace {

constexpr int kMostTicks = 65535;  // maximum of MPEG-4's header
constexpr int kLeastTicks = 1000;  // players take coarser clocks for broken ones
constexpr double kWholeTick = 1e-3;

bool AllWhole(const std::vector<double>& times_s, int ticks) {
  return std::all_of(times_s.begin(), times_s.end(), [&](double time_s) {
    const double at = time_s * ticks;
    return std::abs(at - std::round(at)) < kWholeTick;
  });
}

}  // namespace

int TicksPerSecond(const std::vector<double>& times_s) {
  if (times_s.size() > 1 && times_s.back() > times_s.front()) {
    const double rate =
        static_cast<double>(times_s.size() - 1) / (times_s.back() - times_s.front());
    const AVRational exact = av_d2q(rate, kMostTicks);
    const int factor = exact.num > 0 ? (kLeastTicks + exact.num - 1) / exact.num : 0;
    if (factor > 0 && exact.num <= kMostTicks / factor && AllWhole(times_s, exact.num * factor)) {
      return exact.num * factor;
    }
  }
  for (const int ticks :
       {1000, 24000, 30000, 60000, 48000, 12800, 15360, 16000, 18000, 44100, 50000}) {
    if (AllWhole(times_s, ticks)) return ticks;
  }
  return 60000;
}

}  // namespace color3d
