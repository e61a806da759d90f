// Sensible number of Gaussians for the photos of a scene. Pure functions.
#pragma once

#include <vector>

#include "core/scene/camera.h"

namespace color3d {

// Weight of the limits for few views: 1 for at most `sparse_views` of them, else (sparse_views /
// views)^2.
double Sparsity(double sparse_views, int views);

// Returns `wanted`, or fewer for a small scene: more Gaussians than a share of the training pixels
// (at 500 px or less for few views) cost time and fit noise. `cameras`: of the training views at
// full size.
int GaussianCap(int wanted, const std::vector<Camera>& cameras, int max_side_px);

}  // namespace color3d
