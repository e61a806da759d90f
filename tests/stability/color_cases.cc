// Lab at and beyond the corners of the gamut: pictures in float32 against the float64 functions.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "tests/stability/stability_case.h"

namespace color3d {
namespace {

Image Row(const std::vector<std::array<double, 3>>& colors) {
  Image row(static_cast<int>(colors.size()), 1, 3);
  for (size_t i = 0; i < colors.size(); ++i) {
    for (int c = 0; c < 3; ++c)
      row.At(c, 0, static_cast<int>(i)) = static_cast<float>(colors[i][c]);
  }
  return row;
}

std::vector<std::array<double, 3>> Cube(const std::vector<double>& values) {
  std::vector<std::array<double, 3>> colors;
  for (const double r : values) {
    for (const double g : values) {
      for (const double b : values) colors.push_back({r, g, b});
    }
  }
  return colors;
}

// sRGB to Lab, relative to 100.
StabilityResult ToLab(const std::vector<std::array<double, 3>>& colors) {
  StabilityResult r;
  r.condition = 1.0;
  r.condition_of = "-";
  const Image srgb = Row(colors), lab = LabFromSrgb(srgb);
  r.non_finite = CountNonFinite(lab.data.data(), lab.data.size());
  r.compared = static_cast<int64_t>(lab.data.size());
  r.value_error = 0.0;
  for (int i = 0; i < srgb.width; ++i) {
    const LabColor expected =
        LabFromSrgb(RgbColor{srgb.At(0, 0, i), srgb.At(1, 0, i), srgb.At(2, 0, i)});
    r.value_error = std::max({r.value_error,
                              std::abs(lab.At(0, 0, i) - expected.l) / 100.0,
                              std::abs(lab.At(1, 0, i) - expected.a) / 100.0,
                              std::abs(lab.At(2, 0, i) - expected.b) / 100.0});
  }
  r.value_bound = 1e-6;
  return r;
}

// sRGB to Lab and back, of 0..1.
StabilityResult RoundTrip(const std::vector<std::array<double, 3>>& colors) {
  StabilityResult r;
  r.condition_of = "-";
  const Image srgb = Row(colors), back = SrgbFromLab(LabFromSrgb(srgb));
  r.non_finite = CountNonFinite(back.data.data(), back.data.size());
  r.compared = static_cast<int64_t>(back.data.size());
  r.value_error = 0.0;
  for (size_t i = 0; i < back.data.size(); ++i) {
    r.value_error = std::max(r.value_error, std::abs(1.0 * back.data[i] - srgb.data[i]));
  }
  r.value_bound = 1.0 / 1020.0;  // a quarter of a step of 8 bits
  return r;
}

// Lab beyond the gamut becomes a displayable colour.
StabilityResult Beyond(const std::vector<std::array<double, 3>>& colors) {
  StabilityResult r;
  r.condition_of = "-";
  const Image srgb = SrgbFromLab(Row(colors));
  r.non_finite = CountNonFinite(srgb.data.data(), srgb.data.size());
  r.compared = static_cast<int64_t>(srgb.data.size());
  r.held = std::all_of(
      srgb.data.begin(), srgb.data.end(), [](float v) { return v >= 0.0f && v <= 1.0f; });
  r.outcome = "in 0..1";
  return r;
}

// Differences of equal and of opposite colours.
StabilityResult Differences() {
  StabilityResult r;
  r.condition_of = "-";
  const std::vector<LabColor> colors = {{0, 0, 0},
                                        {100, 0, 0},
                                        {50, 1e-12, -1e-12},
                                        {50, 128, 128},
                                        {50, -128, -128},
                                        {50, 1e6, -1e6}};
  for (const LabColor& x : colors) {
    for (const LabColor& y : colors) {
      const double forth = DeltaE00(x, y), back = DeltaE00(y, x);
      r.non_finite += std::isfinite(forth) ? 0 : 1;
      r.held = r.held && forth >= 0.0 && std::abs(forth - back) <= 1e-9 * (1.0 + forth) &&
               (&x != &y || forth == 0.0);
      ++r.compared;
    }
  }
  r.outcome = "symmetric, 0 for equal colours";
  return r;
}

}  // namespace

void AddColorCases(std::vector<StabilityCase>& cases) {
  const auto add = [&](const std::string& name, auto run) {
    cases.push_back({"colour", name, false, [run](ThreadPool&) { return run(); }});
  };
  add("the eight corners of the gamut", [] { return ToLab(Cube({0.0, 1.0})); });
  add("near the corners, and the knee of the curve", [] {
    return ToLab(Cube({0.0, 1e-30, 1e-7, 0.04044, 0.04046, 0.5, 1.0 - 1e-7, 1.0}));
  });
  add("there and back, a cube of 17^3", [] {
    std::vector<double> values;
    for (int i = 0; i <= 16; ++i) values.push_back(i / 16.0);
    return RoundTrip(Cube(values));
  });
  add("chroma of 10^3 beyond the gamut", [] {
    return Beyond(Cube({-1e3, -128.0, 0.0, 50.0, 100.0, 128.0, 1e3}));
  });
  add("Lab of 1e30", [] { return Beyond(Cube({-1e30, 0.0, 50.0, 1e30})); });
  add("differences of extreme colours", Differences);
}

}  // namespace color3d
