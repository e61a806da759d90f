#include "core/stage/report/source_overlay.h"

#include <array>

#include "core/carry/confidence.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

constexpr std::array<float, 3> kBlue = {0.25f, 0.50f, 0.82f};
constexpr std::array<float, 3> kOrange = {0.85f, 0.51f, 0.10f};
constexpr int kStripePx = 4;

}  // namespace

Image ShadeBySource(const Image& photo, const Image& provenance) {
  const Image shares = Resize(provenance, photo.width, photo.height);
  Image shaded(photo.width, photo.height, 3);
  for (int y = 0; y < photo.height; ++y) {
    for (int x = 0; x < photo.width; ++x) {
      const float gray =
          0.3f * photo.At(0, y, x) + 0.59f * photo.At(1, y, x) + 0.11f * photo.At(2, y, x);
      const float base = 0.18f + 0.78f * gray;  // so that shades show on black
      const float guessed = shares.At(kGuessedPlane, y, x),
                  inferred = shares.At(kInferredPlane, y, x);
      const bool stripe = (x + y) / kStripePx % 2 == 0;
      const float orange = guessed * (stripe ? 0.85f : 0.15f), blue = 0.45f * inferred;
      for (int c = 0; c < 3; ++c) {
        shaded.At(c, y, x) = base + blue * (kBlue[c] - base) + orange * (kOrange[c] - base);
      }
    }
  }
  return shaded;
}

}  // namespace color3d
