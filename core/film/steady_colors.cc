#include "core/film/steady_colors.h"

#include <vector>

#include "core/base/range_check.h"
#include "core/image/flow_agreement.h"
#include "core/image/plane_sampling.h"

namespace color3d {
namespace {

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

// A place in a frame, and the weights that sample its planes.
struct Place {
  Place(const Image& frame, float at_x, float at_y)
      : x(at_x), y(at_y), pixels(frame.width, frame.height, at_x, at_y) {}

  // Moves to the place in the next frame; false where forward and backward flow disagree. The
  // backward flow is that of the nearest pixel.
  bool Follow(const Image& there, const Image& back) {
    const float dx = pixels.Of(there.Plane(0)), dy = pixels.Of(there.Plane(1));
    const float next_x = x + dx, next_y = y + dy;
    if (next_x < 0.0f || next_x > static_cast<float>(there.width - 1) || next_y < 0.0f ||
        next_y > static_cast<float>(there.height - 1)) {
      return false;
    }
    const int nearest =
        static_cast<int>(next_y + 0.5f) * there.width + static_cast<int>(next_x + 0.5f);
    if (!FlowAgrees(dx, dy, back.Plane(0)[nearest], back.Plane(1)[nearest])) return false;
    *this = Place(there, next_x, next_y);
    return true;
  }

  float x, y;
  BilinearPlace pixels;
};

// Adds to a row of frame `index` the colours along its pixels' tracks into the frames after it
// (direction 1) or before it (-1). Frame by frame, so that few planes are read at a time.
void AddFollowed(const std::vector<MovingFrame>& frames,
                 int index,
                 int direction,
                 int row,
                 const SteadyColorsOptions& options,
                 std::vector<WeightedColor>* colors) {
  const Image& here = *frames[index].ab;
  std::vector<Place> places;
  std::vector<int> followed;  // of the row's pixels
  for (int x = 0; x < here.width; ++x) {
    places.emplace_back(here, static_cast<float>(x), static_cast<float>(row));
    followed.push_back(x);
  }
  float share = 1.0f;
  for (int step = 1; step <= options.reach && !followed.empty(); ++step) {
    const int now = index + direction * step;
    if (now < 0 || now >= static_cast<int>(frames.size())) return;
    const FlowPair* flow = frames[direction > 0 ? now : now + 1].flow_from_last.get();
    if (flow == nullptr) return;
    const Image& there = direction > 0 ? flow->forth : flow->back;
    const Image& back = direction > 0 ? flow->back : flow->forth;
    std::erase_if(followed, [&](int x) { return !places[x].Follow(there, back); });
    share *= static_cast<float>(options.persistence);
    for (const int x : followed) (*colors)[x].Add(*frames[now].ab, places[x].pixels, share);
  }
}

}  // namespace

void SteadyColorsOptions::Validate() const {
  const RangeCheck check("option of steady colours");
  check("reach", reach, 0, 32);
  check("persistence", persistence, 0, 1);
}

Image SteadyColors(const std::vector<MovingFrame>& frames,
                   int index,
                   const SteadyColorsOptions& options) {
  options.Validate();
  Image steady = *frames[index].ab;
  std::vector<WeightedColor> colors(steady.width);
  for (int y = 0; y < steady.height; ++y) {
    for (int x = 0; x < steady.width; ++x) {
      colors[x] = {steady.At(0, y, x), steady.At(1, y, x), 1.0f};
    }
    for (const int direction : {-1, 1}) {
      AddFollowed(frames, index, direction, y, options, &colors);
    }
    for (int x = 0; x < steady.width; ++x) {
      steady.At(0, y, x) = colors[x].a / colors[x].weight;
      steady.At(1, y, x) = colors[x].b / colors[x].weight;
    }
  }
  return steady;
}

}  // namespace color3d
