#include "core/film/steady_colors.h"

#include "core/base/range_check.h"
#include "core/image/flow_agreement.h"
#include "core/image/plane_sampling.h"

namespace color3d {
namespace {

struct Place {
  float x = 0.0f;
  float y = 0.0f;
};

struct WeightedColor {
  float a = 0.0f;
  float b = 0.0f;
  float weight = 0.0f;

  void Add(const Image& ab, const BilinearPlace& at, float share) {
    a += share * at.Of(ab.Plane(0));
    b += share * at.Of(ab.Plane(1));
    weight += share;
  }
};

// Takes a place of one frame to where it lies in the next; false where flow does not surely tell.
bool Follow(const Image& there, const Image& back, Place* place) {
  const int width = there.width, height = there.height;
  const BilinearPlace from(width, height, place->x, place->y);
  const float x = from.Of(there.Plane(0)), y = from.Of(there.Plane(1));
  *place = {place->x + x, place->y + y};
  if (place->x < 0.0f || place->x > static_cast<float>(width - 1) || place->y < 0.0f ||
      place->y > static_cast<float>(height - 1)) {
    return false;
  }
  const BilinearPlace to(width, height, place->x, place->y);
  return FlowAgrees(x, y, to.Of(back.Plane(0)), to.Of(back.Plane(1)));
}

// What the frames behind `index` (direction 1) or before it (-1) show where `place` goes.
void AddFollowed(const std::vector<FrameInMotion>& frames,
                 int index,
                 int direction,
                 Place place,
                 const SteadyColorsOptions& options,
                 WeightedColor* color) {
  float share = 1.0f;
  for (int step = 1; step <= options.reach; ++step) {
    const int now = index + direction * step;
    if (now < 0 || now >= static_cast<int>(frames.size())) return;
    const FlowPair* flow = frames[direction > 0 ? now : now + 1].flow_from_last.get();
    if (flow == nullptr) return;
    const bool followed = direction > 0 ? Follow(flow->forth, flow->back, &place)
                                        : Follow(flow->back, flow->forth, &place);
    if (!followed) return;
    share *= static_cast<float>(options.persistence);
    const Image& ab = *frames[now].ab;
    color->Add(ab, BilinearPlace(ab.width, ab.height, place.x, place.y), share);
  }
}

}  // namespace

void SteadyColorsOptions::Validate() const {
  const RangeCheck check("option of steady colours");
  check("reach", reach, 0, 32);
  check("persistence", persistence, 0, 1);
}

Image SteadyColors(const std::vector<FrameInMotion>& frames,
                   int index,
                   const SteadyColorsOptions& options) {
  options.Validate();
  Image steady = *frames[index].ab;
  for (int y = 0; y < steady.height; ++y) {
    for (int x = 0; x < steady.width; ++x) {
      const Place place{static_cast<float>(x), static_cast<float>(y)};
      WeightedColor color{steady.At(0, y, x), steady.At(1, y, x), 1.0f};
      for (const int direction : {-1, 1}) {
        AddFollowed(frames, index, direction, place, options, &color);
      }
      steady.At(0, y, x) = color.a / color.weight;
      steady.At(1, y, x) = color.b / color.weight;
    }
  }
  return steady;
}

}  // namespace color3d
