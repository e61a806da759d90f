// Sizes, learning rates and penalties of a deformation by feature planes (DYNAMIC.md "HexPlane").
// A plain value. The defaults are those of GeometryOptions::Recipe::kColor3d.
#pragma once

namespace color3d {

struct HexPlaneTuning {
  double from = 0.15;      // fraction of the schedule; before, the scene is trained as static
  int features = 16;       // a multiple of 16
  int width = 64;          // of the network's layers, a multiple of 16
  int levels = 2;          // of planes; each has twice the samples along space of the one before
  int space_samples = 64;  // of the first level
  double samples_of_step = 0.5;  // along time, for each time step
  double plane_rate = 8e-3;      // learning rates at the start of the deformation
  double network_rate = 1.6e-3;
  double last_rate = 0.1;     // both fall to this multiple, log-linearly
  double variation = 2e-4;    // penalties, each times a mean over a plane: neighbours in space
  double smoothness = 1e-3;   // second differences in time
  double time_change = 1e-4;  // distance of planes with time from 1

  bool operator==(const HexPlaneTuning&) const = default;
};

// Calls visit(name, value) for every field, in order.
template <class Tuning, class Visit>
void VisitHexPlaneFields(Tuning& tuning, Visit&& visit) {
  visit("hexplane_from", tuning.from);
  visit("hexplane_features", tuning.features);
  visit("hexplane_width", tuning.width);
  visit("hexplane_levels", tuning.levels);
  visit("hexplane_space_samples", tuning.space_samples);
  visit("hexplane_samples_of_step", tuning.samples_of_step);
  visit("hexplane_plane_rate", tuning.plane_rate);
  visit("hexplane_network_rate", tuning.network_rate);
  visit("hexplane_last_rate", tuning.last_rate);
  visit("hexplane_variation", tuning.variation);
  visit("hexplane_smoothness", tuning.smoothness);
  visit("hexplane_time_change", tuning.time_change);
}

}  // namespace color3d
