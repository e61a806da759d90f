// Which view to colour next, after a scene has been coloured. For the report stage only.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/base/image.h"
#include "core/scene/scene.h"
#include "core/stage/sources/seen_samples.h"
#include "core/stage/stage.h"

namespace color3d {

struct NextKeyViewFacts {
  std::string name;
  double error_now = 0.0;   // CIEDE2000 that is expected over all views
  double error_with = 0.0;  // ... with this view coloured, too
};

// What is expected of places of a view (seen_samples.h), by where its colour comes from: `shares`
// has the 3 channels of its provenance.
std::vector<float> ExpectedErrorsOf(const Image& shares, const SampleGrid& grid);

// From the model's geometry and the views' provenance. Nothing when one of them is not among the
// inputs, there are more than 500 views, or no view would save anything. `key_views`: names.
std::optional<NextKeyViewFacts> AdviseNextKeyView(const Scene& scene,
                                                  const std::vector<std::string>& key_views,
                                                  StageContext& context);

}  // namespace color3d
