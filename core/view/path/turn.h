// A way around what the key view shows, without a beginning or an end: a full circle where photos
// stand all around, else a sway that stays among them. The page and movies take the same. Pure
// functions.
#pragma once

#include <Eigen/Core>

#include "core/scene/scene.h"
#include "core/view/stand.h"

namespace color3d {

// Angles of the page's world (stand.h), radians around its y axis; the key view's camera is at 0.
struct Turn {
  bool around = false;
  double middle = 0.0;                              // of the sway
  double reach = 0.0;                               // of the sway, to either side of its middle
  Eigen::Vector3d start = Eigen::Vector3d::Zero();  // the key view's camera, page's units
};

// `stand`: of the key view (StandOf).
Turn TurnOf(const Scene& scene, int key_view, const Stand& stand);

// Where the camera is after this share of the turn, in the page's units; the share wraps, and 0 is
// the key view. It looks at the origin.
Eigen::Vector3d TurnPosition(const Turn& turn, double share);

}  // namespace color3d
