#include "core/video/ticks.h"

#include <gtest/gtest.h>

#include <cmath>

namespace color3d {
namespace {

double WorstError(const std::vector<double>& times, int ticks) {
  double worst = 0.0;
  for (const double time : times) {
    worst = std::max(worst, std::abs(std::round(time * ticks) / ticks - time));
  }
  return worst;
}

TEST(Ticks, EvenRatesAreExact) {
  for (const double rate : {1.0,
                            8.0,
                            12.0,
                            16.0,
                            16.66,
                            17.0,
                            18.0,
                            23.0,
                            24.0,
                            24000.0 / 1001,
                            25.0,
                            30000.0 / 1001,
                            48.0,
                            50.0,
                            60000.0 / 1001,
                            119.88}) {
    std::vector<double> times;
    for (int i = 0; i < 3000; ++i) times.push_back(i / rate);
    const int ticks = TicksPerSecond(times);
    EXPECT_GE(ticks, 1000) << rate;
    EXPECT_LE(ticks, 65535) << rate;
    EXPECT_LT(WorstError(times, ticks), 1e-6) << rate;
  }
}

TEST(Ticks, UnevenTimesAreKept) {
  // Milliseconds, as Matroska has them; a film at 12 and 24 in turn; one of 90000 ticks.
  const std::vector<double> milliseconds = {0.0, 0.042, 0.083, 0.125, 0.167, 0.5};
  EXPECT_LT(WorstError(milliseconds, TicksPerSecond(milliseconds)), 1e-9);
  std::vector<double> mixed = {0.0};
  for (int i = 0; i < 50; ++i) mixed.push_back(mixed.back() + (i % 7 < 3 ? 1 / 12.0 : 1 / 24.0));
  EXPECT_LT(WorstError(mixed, TicksPerSecond(mixed)), 1e-6);
  const std::vector<double> odd = {0.0, 3001 / 90000.0, 7507 / 90000.0, 11111 / 90000.0};
  EXPECT_LT(WorstError(odd, TicksPerSecond(odd)), 9e-6);
  EXPECT_GE(TicksPerSecond({0.0}), 1000);
}

}  // namespace
}  // namespace color3d
