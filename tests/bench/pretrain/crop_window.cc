#include "tests/bench/pretrain/crop_window.h"

#include <algorithm>
#include <cmath>

namespace color3d {
namespace {

constexpr double kMinSidePx = 8.0;
constexpr double kMaxStepPx = 1.4;  // maximum distance of samples in the photo

}  // namespace

std::array<double, 2> CropWindow::At(double u, double v) const {
  return {origin[0] + u * across[0] + v * down[0], origin[1] + u * across[1] + v * down[1]};
}

std::array<double, 2> CropWindow::Inverse(const std::array<double, 2>& point) const {
  const double x = point[0] - origin[0], y = point[1] - origin[1];
  const double area = across[0] * down[1] - across[1] * down[0];
  return {(x * down[1] - y * down[0]) / area, (across[0] * y - across[1] * x) / area};
}

CropWindow RandomWindow(const BytePhoto& photo, const WindowOptions& options, Random& random) {
  const double area = random.NextUniform(options.min_area, 1.0) * photo.width * photo.height;
  const double aspect = std::exp(random.NextUniform(-1.0, 1.0) * std::log(options.max_aspect));
  double width = std::clamp<double>(std::sqrt(area * aspect), kMinSidePx, photo.width);
  double height = std::clamp<double>(std::sqrt(area / aspect), kMinSidePx, photo.height);
  const double turn = options.max_turn * random.NextUniform(-1.0, 1.0);
  const double c = std::cos(turn), s = std::sin(turn);
  // Shrinks until the rotated window fits.
  const auto box = [&] {
    return std::array<double, 2>{width * c + height * std::abs(s),
                                 width * std::abs(s) + height * c};
  };
  const double fit = std::min({1.0, photo.width / box()[0], photo.height / box()[1]});
  width *= fit;
  height *= fit;
  const double x = random.NextUniform() * std::max(0.0, photo.width - box()[0]) + 0.5 * box()[0];
  const double y = random.NextUniform() * std::max(0.0, photo.height - box()[1]) + 0.5 * box()[1];
  const double side = random.NextUniform() < options.mirror_probability ? -1.0 : 1.0;
  CropWindow window;
  window.across = {side * width * c, side * width * s};
  window.down = {-height * s, height * c};
  window.origin = {x - 0.5 * (window.across[0] + window.down[0]),
                   y - 0.5 * (window.across[1] + window.down[1])};
  return window;
}

Image SampleWindow(const BytePhoto& photo, const CropWindow& window, int size_px) {
  const double step = std::max(std::hypot(window.across[0], window.across[1]),
                               std::hypot(window.down[0], window.down[1])) /
                      size_px;
  const int samples = std::max(1, static_cast<int>(std::ceil(step / kMaxStepPx)));
  const double inverse = 1.0 / (static_cast<double>(size_px) * samples);
  const auto scale = static_cast<float>(1.0 / (255.0 * samples * samples));
  const size_t plane = static_cast<size_t>(photo.width) * photo.height;
  Image out(size_px, size_px, 3);
  for (int i = 0; i < size_px * samples; ++i) {
    for (int j = 0; j < size_px * samples; ++j) {
      const std::array<double, 2> p = window.At((j + 0.5) * inverse, (i + 0.5) * inverse);
      const double x = std::clamp(p[0] - 0.5, 0.0, photo.width - 1.0);
      const double y = std::clamp(p[1] - 0.5, 0.0, photo.height - 1.0);
      const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
      const int right = x0 + 1 < photo.width ? 1 : 0;
      const size_t below = y0 + 1 < photo.height ? photo.width : 0;
      const auto fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
      const uint8_t* at = &photo.data[static_cast<size_t>(y0) * photo.width + x0];
      const size_t target = static_cast<size_t>(i / samples) * size_px + j / samples;
      for (int k = 0; k < 3; ++k, at += plane) {
        const float top = (1.0f - fx) * at[0] + fx * at[right];
        const float bottom = (1.0f - fx) * at[below] + fx * at[below + right];
        out.Plane(k)[target] += scale * ((1.0f - fy) * top + fy * bottom);
      }
    }
  }
  return out;
}

}  // namespace color3d
