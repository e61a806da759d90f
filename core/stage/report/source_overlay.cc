#include "core/stage/report/source_overlay.h"

#include <algorithm>
#include <array>

#include "core/carry/confidence.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

// #6fb7b0, #e0b25f and #b873a0, the shades of the page of a scene (view/page/page.js) and of the
// studio.
constexpr std::array<float, 3> kSeenShade = {0.435f, 0.718f, 0.690f};
constexpr std::array<float, 3> kInferredShade = {0.878f, 0.698f, 0.373f};
constexpr std::array<float, 3> kGuessedShade = {0.722f, 0.451f, 0.627f};
constexpr int kStripePx = 4;
constexpr float kStripe = 0.4f;  // share of the brightness that stripes take away

}  // namespace

Image ShadeBySource(const Image& photo, const Image& provenance) {
  const Image shares = Resize(provenance, photo.width, photo.height);
  Image shaded(photo.width, photo.height, 3);
  for (int y = 0; y < photo.height; ++y) {
    for (int x = 0; x < photo.width; ++x) {
      const float gray =
          0.3f * photo.At(0, y, x) + 0.59f * photo.At(1, y, x) + 0.11f * photo.At(2, y, x);
      const float guessed = shares.At(kGuessedPlane, y, x), seen = shares.At(kSeenPlane, y, x),
                  inferred = shares.At(kInferredPlane, y, x);
      const float all = std::max(guessed + seen + inferred, 1e-3f);
      const bool stripe = (x + y) / kStripePx % 2 == 0;
      // So that shades show on black.
      const float bright =
          (0.15f + 0.95f * gray) * (stripe ? 1.0f - kStripe * guessed : 1.0f) / all;
      for (int c = 0; c < 3; ++c) {
        const float shade =
            guessed * kGuessedShade[c] + seen * kSeenShade[c] + inferred * kInferredShade[c];
        shaded.At(c, y, x) = std::min(bright * shade, 1.0f);
      }
    }
  }
  return shaded;
}

}  // namespace color3d
