#include <algorithm>

#include "core/stage/carry/carry_by_kind.h"
#include "core/stage/carry/carry_through_geometry.h"

namespace color3d {
namespace {

// Neighbours in space are read again and again.
constexpr int64_t kPhotosCacheBytes = int64_t{1} << 30;

}  // namespace

void CarryStatic(const CarryInputs& inputs, StageContext& context) {
  const SceneSurfaces surfaces(
      inputs, std::min(kPhotosCacheBytes, context.MemoryBytes() / 4), context);
  const std::vector<ColoredKeyView> keys =
      ReadColoredKeyViews(inputs, surfaces, context, /*edits=*/true);
  const auto carry = [&](int view) {
    return CarryFromAll(keys, surfaces.Of(view), inputs.options.carry);
  };
  // The edited share of an edit has no other source.
  const bool is_edit = keys.front().color.ab.channels > 2;
  CarryIntoViews(inputs, keys, carry, is_edit ? 0.0 : inputs.options.min_agreement, context);
}

}  // namespace color3d
