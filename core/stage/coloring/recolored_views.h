// Colours of views after an edit of the key photo (STILL.md "Recolouring"): the edit is carried and
// inferred, and the views' own colours stay outside. Static scenes only.
#pragma once

#include <map>
#include <memory>
#include <optional>

#include "core/carry/fusion.h"
#include "core/colorizer/colorizer.h"
#include "core/colorizer/corrector.h"
#include "core/keycolor/edit_model.h"
#include "core/scene/scene.h"
#include "core/scene/view_images.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/sources/view_positions.h"

namespace color3d {

// Thread-safe after construction.
class ViewRecolorer {
 public:
  // Returns null if the key view's colours are no edit. The references must outlive the result.
  static std::unique_ptr<const ViewRecolorer> Read(const Scene& scene,
                                                   const ViewImages& images,
                                                   const ViewPositions& positions,
                                                   const Colorizer& colorizer,
                                                   const StageContext& context);

  // Returns nullopt for a grey photo, which has no colours to keep.
  std::optional<FusedColor> Recolor(int view) const;

 private:
  struct KeyView {
    CarriedColor color;  // after the edit
    Image edited;        // 1 channel, 0..1
  };

  ViewRecolorer(const Scene& scene,
                const ViewImages& images,
                const ViewPositions& positions,
                const Colorizer& colorizer,
                const StageContext& context);
  PlacedPicture OwnPicture(int view, const Image& lab) const;
  FusedColor OfKeyView(const KeyView& key, const Image& lab) const;
  FusedColor OfOtherView(int view, const Image& lab) const;

  const Scene& scene_;
  const ViewImages& images_;
  const ViewPositions& positions_;
  const StageContext& context_;
  std::map<int, KeyView> keys_;
  std::optional<EditModel> by_color_;
  std::unique_ptr<const Corrector> by_place_;  // null: the colorizer has no feature neighbours
};

}  // namespace color3d
