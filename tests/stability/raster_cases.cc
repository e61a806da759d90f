// Rasterizer and projection at extreme shapes, sizes, depths, opacities and pictures.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/random.h"
#include "tests/stability/raster_compare.h"

namespace color3d {
namespace {

constexpr int kCoefficients = 4;  // per channel

ColorSpec Channels(int channels) {
  ColorSpec color;
  color.channels = channels;
  for (int c = 0; c < channels; ++c) {
    color.channel[c] = {kColorRow + c * kCoefficients, kCoefficients, 0.5f, c == 0};
  }
  return color;
}

// At the origin, looking along z, so that depths and directions are exact in float32.
RasterCamera FrontCamera(int width, int height) {
  RasterCamera c;
  c.width = width;
  c.height = height;
  c.fx = 40.0f;
  c.fy = 42.0f;
  c.cx = 0.5f * static_cast<float>(width);
  c.cy = 0.5f * static_cast<float>(height);
  return c;
}

// Ordinary Gaussians about two units before the camera, moderately anisotropic.
RasterCase Ordinary(int count, int channels = 1, int width = 48, int height = 40) {
  RasterCase r;
  r.color = Channels(channels);
  r.camera = FrontCamera(width, height);
  Random random(2);
  r.parameters = ParameterBlock(kColorRow + channels * kCoefficients, count);
  ParameterBlock& p = r.parameters;
  const auto uniform = [&](double low, double high) {
    return static_cast<float>(random.NextUniform(low, high));
  };
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < 2; ++k) p.Row(kPositionRow + k)[i] = uniform(-0.8, 0.8);
    p.Row(kPositionRow + 2)[i] = uniform(1.5, 2.5);
    for (int k = 0; k < 3; ++k) p.Row(kLogScaleRow + k)[i] = uniform(-3.5, -1.5);
    for (int k = 0; k < 4; ++k) {
      p.Row(kRotationRow + k)[i] = static_cast<float>(random.NextNormal());
    }
    p.Row(kOpacityRow)[i] = uniform(-1.5, 1.5);
    for (int row = kColorRow; row < p.rows(); ++row) p.Row(row)[i] = uniform(-0.3, 0.3);
  }
  return r;
}

void Fill(ParameterBlock& p, int row, float value) { std::fill_n(p.Row(row), p.count(), value); }

// Scales `large` along some axes and `small` along the others, in rotation.
RasterCase Stretched(double large, double small, bool pancake) {
  RasterCase r = Ordinary(40);
  for (int i = 0; i < 40; ++i) {
    for (int k = 0; k < 3; ++k) {
      const bool along = (i + k) % 3 == 0;
      r.parameters.Row(kLogScaleRow + k)[i] =
          static_cast<float>(std::log(along != pancake ? large : small));
    }
  }
  return r;
}

RasterCase OfScale(double scale) {
  RasterCase r = Ordinary(20);
  for (int k = 0; k < 3; ++k) {
    Fill(r.parameters, kLogScaleRow + k, static_cast<float>(std::log(scale)));
  }
  return r;
}

RasterCase OfQuaternionSize(float size) {
  RasterCase r = Ordinary(20);
  for (int i = 0; i < 20; ++i) {
    float norm = 0.0f;
    for (int k = 0; k < 4; ++k) {
      norm = std::hypot(norm, r.parameters.Row(kRotationRow + k)[i]);
    }
    for (int k = 0; k < 4; ++k) r.parameters.Row(kRotationRow + k)[i] *= size / norm;
  }
  r.condition = size > 0.0f ? std::max(size, 1.0f / size) : std::numeric_limits<double>::infinity();
  r.condition_of = "quaternion norm";
  return r;
}

RasterCase OfOpacityLogit(float logit) {
  RasterCase r = Ordinary(20);
  for (int i = 0; i < 20; ++i) r.parameters.Row(kOpacityRow)[i] = i % 2 == 0 ? logit : -logit;
  return r;
}

// Splats smaller than a pixel, all on the middle one.
RasterCase OnOnePixel(int count, float logit) {
  RasterCase r = Ordinary(count, 1, 9, 9);
  for (int k = 0; k < 2; ++k) Fill(r.parameters, kPositionRow + k, 0.0f);
  for (int k = 0; k < 3; ++k) Fill(r.parameters, kLogScaleRow + k, -12.0f);
  Fill(r.parameters, kOpacityRow, logit);
  r.condition = count;
  r.condition_of = "splats on the pixel";
  return r;
}

// Depths around the near plane, on the axis and far to the side; some contain the camera.
RasterCase AroundNearPlane() {
  RasterCase r = Ordinary(64);
  const float depths[] = {-10.0f, -0.2f, 0.0f, 1e-7f, 0.19999f, 0.2f, 0.20001f, 0.3f};
  for (int i = 0; i < 64; ++i) {
    r.parameters.Row(2)[i] = depths[i % 8];
    if (i < 32) {
      for (int k = 0; k < 2; ++k) r.parameters.Row(k)[i] *= 0.1f;
    } else {
      r.parameters.Row(0)[i] = 100.0f;
    }
    const float log_scale = i % 3 == 0 ? 1.0f : -3.0f;
    for (int k = 0; k < 3; ++k) r.parameters.Row(kLogScaleRow + k)[i] = log_scale;
  }
  return r;
}

RasterCase CameraInside() {
  RasterCase r = Ordinary(24);
  for (int i = 0; i < 24; ++i) {
    for (int k = 0; k < 2; ++k) r.parameters.Row(k)[i] *= 0.2f;
    r.parameters.Row(2)[i] = 0.21f + 0.02f * static_cast<float>(i);
    for (int k = 0; k < 3; ++k) r.parameters.Row(kLogScaleRow + k)[i] = 0.1f * k - 0.5f;
  }
  return r;
}

RasterCase BehindTheCamera() {
  RasterCase r = Ordinary(24);
  for (int i = 0; i < 24; ++i) r.parameters.Row(2)[i] *= -1.0f;
  return r;
}

RasterCase DepthTies() {
  RasterCase r = Ordinary(48);
  Fill(r.parameters, kPositionRow + 2, 2.0f);
  return r;
}

// Centres exactly on the corners of tiles (u, v = 0, 16, 32, ... px).
RasterCase OnTileBorders() {
  RasterCase r = Ordinary(30, 1, 64, 64);
  r.camera.fx = r.camera.fy = 64.0f;
  for (int i = 0; i < 30; ++i) {
    r.parameters.Row(0)[i] = static_cast<float>(i % 5 - 2) * 0.5f;
    r.parameters.Row(1)[i] = static_cast<float>(i / 5 % 5 - 2) * 0.5f;
    r.parameters.Row(2)[i] = 2.0f;
  }
  return r;
}

RasterCase LargerThanThePicture() {
  RasterCase r = Ordinary(16);
  for (int i = 0; i < 16; ++i) {
    for (int k = 0; k < 3; ++k) r.parameters.Row(kLogScaleRow + k)[i] += 5.0f;
  }
  return r;
}

// Layers of alpha up to the cap: the pixels are finished after two or three of twenty.
RasterCase OpaqueWall() {
  RasterCase r = Ordinary(20);
  for (int i = 0; i < 20; ++i) {
    for (int k = 0; k < 2; ++k) r.parameters.Row(k)[i] *= 0.1f;
    r.parameters.Row(2)[i] = 1.5f + 0.05f * static_cast<float>(i);
    for (int k = 0; k < 3; ++k) r.parameters.Row(kLogScaleRow + k)[i] = 0.3f;
    r.parameters.Row(kOpacityRow)[i] = 3.5f;
  }
  return r;
}

// The same picture with all lengths a million times larger.
RasterCase FarAway() {
  RasterCase r = Ordinary(40);
  for (int i = 0; i < 40; ++i) {
    for (int k = 0; k < 3; ++k) {
      r.parameters.Row(k)[i] *= 1e5f;
      r.parameters.Row(kLogScaleRow + k)[i] += std::log(1e5f);
    }
  }
  return r;
}

// Positions 1e6 units from the origin, unchanged or relative to the cameras' mean as in import
// (Scene::world_offset). The truth is the scene without rounding.
RasterCase AtWorldOffset(bool recentred) {
  RasterCase r = Ordinary(40);
  const double offset[3] = {1.2e6, -0.8e6, 1.0e6};
  const double angle = 0.3, c = std::cos(angle), s = std::sin(angle);
  const double rotation[9] = {c, 0, -s, 0, 1, 0, s, 0, c};
  std::copy(rotation, rotation + 9, r.camera.rotation);
  r.truth = ReferenceParameters::From(r.parameters);
  for (int i = 0; i < 40; ++i) {  // in front of the turned camera
    const double x = r.truth->At(0, i), z = r.truth->At(2, i);
    r.truth->At(0, i) = c * x + s * z;
    r.truth->At(2, i) = -s * x + c * z;
  }
  r.truth_camera = r.camera;
  for (int k = 0; k < 3; ++k) {
    const double shift = recentred ? 0.0 : offset[k];
    for (int i = 0; i < 40; ++i) {
      // In float64, as in import: the offset is subtracted before rounding to float32.
      const double world = r.truth->At(k, i) + offset[k];
      r.parameters.Row(k)[i] = static_cast<float>(world - (recentred ? offset[k] : 0.0));
    }
    r.camera.center[k] = static_cast<float>(shift);
  }
  for (int a = 0; a < 3; ++a) {
    double sum = 0.0;
    for (int b = 0; b < 3; ++b) {
      sum -= r.camera.rotation[3 * a + b] * (recentred ? 0.0 : offset[b]);
    }
    r.camera.translation[a] = static_cast<float>(sum);
  }
  // eps * offset moves the picture, and a pixel is distance / focal length.
  r.condition = recentred ? 1.0 : 1.2e6 / 2.0 * 42.0;
  r.condition_of = "offset / pixel size";
  if (!recentred) r.value_bound = r.gradient_bound = kFloatEpsilon * r.condition;
  return r;
}

// Four Gaussians that are not finite: they must neither be rendered nor affect their neighbours.
RasterCase WithBadPositions() {
  RasterCase r = Ordinary(21);
  r.truth = ReferenceParameters::From(r.parameters);
  r.parameters.Resize(25);
  const float bad[] = {1e30f,
                       -1e6f,
                       std::numeric_limits<float>::infinity(),
                       std::numeric_limits<float>::quiet_NaN()};
  for (int i = 0; i < 4; ++i) {
    r.parameters.CopyGaussian(i, 21 + i);
    r.parameters.Row(i % 2)[21 + i] = bad[i];
  }
  return r;
}

RasterCase LargePicture(int width, int height, int count) {
  RasterCase r = Ordinary(count, 1, width, height);
  r.camera.fx = r.camera.fy = 0.5f * static_cast<float>(width);
  for (int i = 0; i < count; ++i) {
    r.parameters.Row(0)[i] *= 2.0f;
    r.parameters.Row(1)[i] *= 2.0f * static_cast<float>(height) / static_cast<float>(width);
    for (int k = 0; k < 3; ++k) r.parameters.Row(kLogScaleRow + k)[i] -= 1.0f;
  }
  // Rounding of a coordinate of 8192 px moves the splat by 2^-11 px.
  r.condition = width;
  r.condition_of = "width in px";
  r.max_pixels = 3000;
  return r;
}

using Adder = std::function<void(std::string, std::function<RasterCase()>)>;

void AddShapes(const Adder& add) {
  for (const int channels : {1, 2, 3}) {
    add(fmt::format("ordinary, {} channels and depth", channels),
        [=] { return Ordinary(60, channels); });
  }
  add("needles 1e2:1", [=] { return Stretched(1.0, 1e-2, false); });
  add("needles 1e4:1", [=] { return Stretched(1.0, 1e-4, false); });
  add("needles 1e6:1", [=] {
    RasterCase r = Stretched(10.0, 1e-5, false);
    // Turning a needle moves its ends: the gradient's condition is that of the covariance, 2.5e5.
    r.gradient_bound = 8.0 * kFloatEpsilon * 2.5e5;
    return r;
  });
  add("pancakes 1e2:1", [=] { return Stretched(1.0, 1e-2, true); });
  add("pancakes 1e4:1", [=] { return Stretched(1.0, 1e-4, true); });
  add("pancakes 1e6:1", [=] { return Stretched(10.0, 1e-5, true); });
  for (const auto& [name, value] : {std::pair{"1e-8", 1e-8},
                                    {"1e-4", 1e-4},
                                    {"1", 1.0},
                                    {"1e2", 1e2},
                                    {"1e4", 1e4},
                                    {"1e6", 1e6}}) {
    const double scale = value;
    add(std::string("scale ") + name, [=] { return OfScale(scale); });
  }
  for (const auto& [name, value] : {std::pair{"zero", 0.0f},
                                    {"1e-20", 1e-20f},
                                    {"1e-6", 1e-6f},
                                    {"1e18", 1e18f},
                                    {"1e30", 1e30f}}) {
    const float size = value;
    add(std::string("quaternion norm ") + name, [=] { return OfQuaternionSize(size); });
  }
}

void AddScenes(const Adder& add) {
  add("opacity logits +-40", [=] { return OfOpacityLogit(40.0f); });
  add("opacity logits +-1e30", [=] { return OfOpacityLogit(1e30f); });
  add("1e5 splats on one pixel", [=] { return OnOnePixel(100'000, -4.0f); });
  add("1e5 faint splats on one pixel", [=] { return OnOnePixel(100'000, -5.4f); });
  add("camera inside the splats", [=] { return CameraInside(); });
  add("at, near and behind the near plane", [=] { return AroundNearPlane(); });
  add("all behind the camera", [=] { return BehindTheCamera(); });
  add("no Gaussians", [=] { return Ordinary(0); });
  add("depth ties", [=] { return DepthTies(); });
  add("centres on tile corners", [=] { return OnTileBorders(); });
  add("larger than the picture", [=] { return LargerThanThePicture(); });
  add("opaque walls", [=] { return OpaqueWall(); });
  add("positions that are huge or not finite", [=] { return WithBadPositions(); });
  add("distances of 1e5", [=] { return FarAway(); });
  add("world offset 1e6, recentred", [=] { return AtWorldOffset(true); });
  add("world offset 1e6, unchanged", [=] { return AtWorldOffset(false); });
}

}  // namespace

void AddRasterCases(std::vector<StabilityCase>& cases) {
  const Adder add = [&](std::string name, std::function<RasterCase()> make) {
    cases.push_back({"raster", std::move(name), false, [make](ThreadPool& pool) {
                       return CompareRaster(make(), pool);
                     }});
  };
  AddShapes(add);
  AddScenes(add);
  for (const auto& [w, h] : {std::pair{1, 1}, {17, 5}, {1, 50}, {50, 1}}) {
    const int width = w, height = h;
    add(fmt::format("picture of {}x{} px", width, height),
        [=] { return Ordinary(30, 1, width, height); });
  }
  add("picture of 8192x16 px", [] { return LargePicture(8192, 16, 300); });
  add("picture of 8192x8192 px", [] { return LargePicture(8192, 8192, 2000); });
  cases.back().slow = true;
}

}  // namespace color3d
