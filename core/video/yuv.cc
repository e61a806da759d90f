#include "core/video/yuv.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace color3d {
namespace {

constexpr float kRed = 0.2126f, kGreen = 0.7152f, kBlue = 0.0722f;  // of luma, BT.709

uint8_t Byte(float value) {
  return static_cast<uint8_t>(std::lround(std::clamp(value, 0.0f, 255.0f)));
}

float Clamped(float value) { return value > 0.0f ? std::min(value, 1.0f) : 0.0f; }  // NaN: 0

}  // namespace

void YuvFromSrgb(const Image& srgb, BytePlane y, BytePlane cb, BytePlane cr, ThreadPool& pool) {
  const int width = srgb.width;
  pool.ForRanges(srgb.height / 2, [&](int64_t begin, int64_t end, int) {
    std::vector<float> blue(width), red(width);  // differences to luma, of two rows together
    for (int64_t pair = begin; pair < end; ++pair) {
      std::fill(blue.begin(), blue.end(), 0.0f);
      std::fill(red.begin(), red.end(), 0.0f);
      for (int64_t row = 2 * pair; row < 2 * pair + 2; ++row) {
        const size_t at = static_cast<size_t>(row) * width;
        const float *r = srgb.Plane(0) + at, *g = srgb.Plane(1) + at, *b = srgb.Plane(2) + at;
        uint8_t* luma_row = y.data + row * y.stride;
        for (int x = 0; x < width; ++x) {
          const float rx = Clamped(r[x]), gx = Clamped(g[x]), bx = Clamped(b[x]);
          const float luma = kRed * rx + kGreen * gx + kBlue * bx;
          luma_row[x] = Byte(16.0f + 219.0f * luma);
          blue[x] += 0.5f * (bx - luma);
          red[x] += 0.5f * (rx - luma);
        }
      }
      uint8_t* cb_row = cb.data + pair * cb.stride;
      uint8_t* cr_row = cr.data + pair * cr.stride;
      for (int x = 0; x < width; x += 2) {
        const int left = std::max(x - 1, 0);
        const float b = 0.25f * (blue[left] + 2.0f * blue[x] + blue[x + 1]);
        const float r = 0.25f * (red[left] + 2.0f * red[x] + red[x + 1]);
        cb_row[x / 2] = Byte(128.0f + 224.0f * b / (2.0f * (1.0f - kBlue)));
        cr_row[x / 2] = Byte(128.0f + 224.0f * r / (2.0f * (1.0f - kRed)));
      }
    }
  });
}

}  // namespace color3d
