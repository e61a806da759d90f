// A way around what the key view shows, without a beginning or an end: a full circle where photos
// stand all around, else a sway that stays among them; as high and as far away as the photos that
// are near. The page and movies take the same. Pure functions.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/scene/scene.h"
#include "core/view/stand.h"

namespace color3d {

struct Turn {
  // A camera as seen from the origin of the page's world (stand.h), radians.
  struct Place {
    double angle = 0.0;         // around the y axis
    double height = 0.0;        // above the level
    double log_distance = 0.0;  // page's units
  };
  Place start;  // the key view's camera
  bool around = false;
  // Angles from `start` on.
  double middle = 0.0;        // of the sway
  double reach = 0.0;         // of the sway, to either side of its middle
  std::vector<Place> photos;  // all of them
};

// `stand`: of the key view (StandOf).
Turn TurnOf(const Scene& scene, int key_view, const Stand& stand);

// Where the camera is after this share of the turn, in the page's units; the share wraps, and 0 is
// the key view. It looks at the origin.
Eigen::Vector3d TurnPosition(const Turn& turn, double share);

}  // namespace color3d
