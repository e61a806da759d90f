// Proposal of the view to colour next. For the report stage only.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

struct NextKeyViewFacts {
  std::string name;
  double error_now = 0.0;   // expected CIEDE2000 over all views
  double error_with = 0.0;  // expected CIEDE2000 with this view as a key view
};

// Proposes a view from the geometry of the model and the features of the photos (cached by the
// selection of the key view, or computed again); for films the middle of the shot without a key
// view that has the least colour. Returns nullopt without a model, for more than 500 training
// views, and if no view would reduce the error. `key_views`: names.
std::optional<NextKeyViewFacts> AdviseNextKeyView(const Scene& scene,
                                                  const std::vector<std::string>& key_views,
                                                  StageContext& context);

}  // namespace color3d
