// The jobs of a colorize_scene submission, as the server plans them, for the simulation: their
// graph and seconds by the planner and the cost model. Their bytes were measured on one
// scene.
#pragma once

#include "tests/bench/scale/queue_model.h"

namespace color3d {

struct CaptureSize {
  int photos = 20;
  double photo_bytes = 3e6;  // of one file
  bool has_poses = true;
};

// Throws Error{kInvalidArgument} for a capture without photos.
SimulatedScene PlannedScene(const CaptureSize& capture);

}  // namespace color3d
