// How many Gaussians, and how long a training, the photos of a scene are worth. Pure functions.
#pragma once

#include <vector>

#include "core/scene/camera.h"

namespace color3d {

// How far few views decide what a scene can hold: 1 with at most `sparse_views` of them, with more
// (sparse_views / views)^2.
double Sparsity(double sparse_views, int views);

// `wanted`, or fewer for a small scene: more Gaussians than a share of the pixels trained on (at
// 500 px or less where views are few) cost time and fit noise. `cameras`: of the training views at
// full size.
int GaussianCap(int wanted, const std::vector<Camera>& cameras, int max_side_px);

// `wanted`, or fewer where training views are few: seeing each of them again and again teaches no
// more.
int IterationCap(int wanted, int training_views);

}  // namespace color3d
