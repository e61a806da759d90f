#include "core/splat/chroma/chroma_tile.h"

#include <algorithm>
#include <cmath>

namespace color3d {

void LoadTile(const ChromaPlanes& planes, int x0, int y0, float* target, float* mask) {
  const PlaneBuffer& ab = planes.ab;
  for (int b = 0; b < kTileBlocks; ++b) {
    for (int lane = 0; lane < kBlockPixels; ++lane) {
      const int x = x0 + PixelX(b, lane), y = y0 + PixelY(b, lane);
      const bool inside = x < ab.width && y < ab.height;
      const float w = inside ? planes.weight.Row(0, y)[x] : 0.0f;
      float* t = target + 2 * kBlockPixels * b + lane;
      t[0] = w > 0.0f ? ab.Row(0, y)[x] : 0.0f;
      t[kBlockPixels] = w > 0.0f ? ab.Row(1, y)[x] : 0.0f;
      mask[kBlockPixels * b + lane] = w > 0.0f ? w : 0.0f;
    }
  }
}

void LoadConfidence(const PlaneBuffer& confidence, int x0, int y0, const float* mask, float* sure) {
  for (int b = 0; b < kTileBlocks; ++b) {
    for (int lane = 0; lane < kBlockPixels; ++lane) {
      const int x = x0 + PixelX(b, lane), y = y0 + PixelY(b, lane);
      const float w = mask[kBlockPixels * b + lane];
      float* s = sure + 2 * kBlockPixels * b + lane;
      s[0] = w;
      s[kBlockPixels] = w > 0.0f ? w * confidence.Row(0, y)[x] : 0.0f;
    }
  }
}

std::array<float, 2> WeighTile(
    const RobustWeights& robust, const float* target, const float* mask, float* picture, float* d) {
  const float scale = static_cast<float>(robust.scale), floor = static_cast<float>(robust.floor);
  float l1 = 0.0f, area = 0.0f;
  for (int b = 0; b < 2 * kTileBlocks; ++b) {
    const float* m = mask + b / 2 * kBlockPixels;
    for (int lane = 0; lane < kBlockPixels; ++lane) {
      const int i = b * kBlockPixels + lane;
      const float r = target[i] - picture[i];
      l1 += m[lane] * std::abs(r);
      area += m[lane];
      d[i] = robust.on ? m[lane] * scale / std::max(std::abs(r), floor) : m[lane];
      picture[i] = r;
    }
  }
  return {l1, area};
}

}  // namespace color3d
