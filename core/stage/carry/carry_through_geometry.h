// Carrying by depth and visibility: the parts that static and dynamic scenes share.
#pragma once

#include <functional>
#include <vector>

#include "core/carry/carry_views.h"
#include "core/scene/view_images.h"
#include "core/stage/carry/carry_by_kind.h"

namespace color3d {

// The photos of a scene and the surfaces that they show. Thread-safe after construction.
class SceneSurfaces {
 public:
  // `cache_bytes`: of decoded photos, and again of those that depth is measured on. `inputs` and
  // `context` must outlive the object.
  SceneSurfaces(const CarryInputs& inputs, int64_t cache_bytes, StageContext& context);

  const ViewImages& images() const { return images_; }
  ViewSurfaces Of(int view) const { return maker_.Make(view); }

 private:
  const ViewImages images_;
  const ViewImages sweep_images_;
  const SurfaceMaker maker_;
};

// The key views with their colours. Each additional one has the colours that those before it give
// it, and its own where they give none. With `edits`, and if the chosen key view is an edit, the
// edited share is the third channel of the colours.
std::vector<ColoredKeyView> ReadColoredKeyViews(const CarryInputs& inputs,
                                                const SceneSurfaces& surfaces,
                                                StageContext& context,
                                                bool edits = false);

// Writes the colours of all views: those of key views as they are, of other ones as `carry` gives
// them. `carry` is called from several threads, for views of one time after each other. If the
// views agree less than `min_agreement` (MeanAgreement), the user is warned and only key views
// keep their colours.
void CarryIntoViews(const CarryInputs& inputs,
                    const std::vector<ColoredKeyView>& keys,
                    const std::function<CarriedColor(int view)>& carry,
                    double min_agreement,
                    StageContext& context);

}  // namespace color3d
