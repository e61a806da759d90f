// A closed camera path around the focus of the key view: a full circle if photos surround it, else
// a sway among them, at the height and distance of the nearby photos. The page and movies use the
// same path. Pure functions.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/scene/scene.h"
#include "core/view/scene_placement.h"

namespace color3d {

struct Turn {
  // A camera seen from the origin of the page's world (scene_placement.h), in radians.
  struct Place {
    double angle = 0.0;         // around the y axis
    double height = 0.0;        // elevation
    double log_distance = 0.0;  // page's units
  };
  Place start;  // the key view's camera
  bool around = false;
  // Angles from `start` on.
  double middle = 0.0;        // of the sway
  double reach = 0.0;         // of the sway, to either side of its middle
  std::vector<Place> photos;  // all of them
};

// `placement`: that of the key view (PlaceScene).
Turn TurnOf(const Scene& scene, int key_view, const ScenePlacement& placement);

// The camera after this share of the turn, in the page's units. The share wraps; 0 is the key view.
// The camera looks at the origin.
Eigen::Vector3d TurnPosition(const Turn& turn, double share);

}  // namespace color3d
