#include <algorithm>

#include "core/stage/carry/carry_by_kind.h"
#include "core/stage/carry/carry_through_geometry.h"
#include "core/stage/film/carried_frames.h"

namespace color3d {
namespace {

// Only the few frames of one time are read again.
constexpr int64_t kFramesCacheBytes = int64_t{64} << 20;

}  // namespace

void CarryDynamic(const CarryInputs& inputs, StageContext& context) {
  const CarryColorOptions& options = inputs.options;
  const SceneSurfaces surfaces(
      inputs, std::min(kFramesCacheBytes, context.MemoryBytes() / 4), context);
  const std::vector<ColoredKeyView> keys = ReadColoredKeyViews(inputs, surfaces, context);
  const CarriedFrames frames(inputs.scene, surfaces.images(), keys, options.film, context);
  const auto carry = [&](int view) {
    const ViewSurfaces target = surfaces.Of(view);
    CarriedColor color;
    if (frames.Has(view)) {
      color = frames.Of(view);
    } else {
      std::vector<ColoredKeyView> sources;
      for (const int frame : frames.NearestTo(view)) {
        sources.push_back({frame, surfaces.Of(frame), frames.Of(frame)});
      }
      color = CarryFromAll(sources, target, options.carry);
    }
    // The rest from the key views as if the scene were static: depth and luminance tell moving
    // objects apart.
    FillFrom(CarryFromAll(keys, target, options.carry), &color);
    return color;
  };
  CarryIntoViews(inputs, keys, carry, /*min_agreement=*/0.0, context);
}

}  // namespace color3d
