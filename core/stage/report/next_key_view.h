// Which view to colour next, after a scene has been coloured. For the report stage only.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

struct NextKeyViewFacts {
  std::string name;
  double error_now = 0.0;   // CIEDE2000 that is expected over all views
  double error_with = 0.0;  // ... with this view coloured, too
};

// From the model's geometry and the photos' features (kept from the selection of the key view, or
// found again); of a film the middle of the shot without a key view of which most is open. Nothing
// without a model, with more than 500 training views, or when no view would save anything.
// `key_views`: names.
std::optional<NextKeyViewFacts> AdviseNextKeyView(const Scene& scene,
                                                  const std::vector<std::string>& key_views,
                                                  StageContext& context);

}  // namespace color3d
