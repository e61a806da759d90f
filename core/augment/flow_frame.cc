#include "core/augment/flow_frame.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/augment/elastic_field.h"
#include "core/image/plane_sampling.h"

namespace color3d {
namespace {

constexpr double kMinZoom = 1.03;
constexpr double kMaxZoom = 1.12;
constexpr double kMaxTurn = 2.0 * std::numbers::pi / 180.0;
constexpr double kFlowShare = 0.03;     // bound of the flow, relative to the longer side
constexpr double kSpacingShare = 0.25;  // spacing of its nodes, relative to the longer side

}  // namespace

GeneratedPicture FlowFrame(const Image& lab, uint64_t seed) {
  Random random(seed, /*stream=*/11);
  const int longer = std::max(lab.width, lab.height);
  const double step = 1.0 / random.NextUniform(kMinZoom, kMaxZoom);
  const double turn = random.NextUniform(-kMaxTurn, kMaxTurn);
  const double cosine = step * std::cos(turn), sine = step * std::sin(turn);
  const ElasticField flow(
      longer, kFlowShare * longer, std::max(4.0, kSpacingShare * longer), random);
  GeneratedPicture frame{Image(lab.width, lab.height, 3), Image(lab.width, lab.height, 1)};
  const double cx = 0.5 * lab.width, cy = 0.5 * lab.height;
  for (int y = 0; y < lab.height; ++y) {
    for (int x = 0; x < lab.width; ++x) {
      const double dx = x + 0.5 - cx, dy = y + 0.5 - cy;
      const PlanePoint offset = flow.At(x + 0.5, y + 0.5);
      const double sx = cx + cosine * dx - sine * dy + offset.x;
      const double sy = cy + sine * dx + cosine * dy + offset.y;
      const bool inside = sx >= 0.0 && sy >= 0.0 && sx <= lab.width && sy <= lab.height;
      frame.weight.At(0, y, x) = inside ? 1.0f : 0.0f;
      for (int c = 0; c < 3; ++c) {
        frame.lab.At(c, y, x) =
            SampleBilinear(lab, c, Reflected(sx, lab.width) - 0.5, Reflected(sy, lab.height) - 0.5);
      }
    }
  }
  return frame;
}

}  // namespace color3d
