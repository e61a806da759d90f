// The one table of what a preset means for each stage.
#pragma once

#include "color3d/v1/stage.pb.h"

namespace color3d {

struct PresetValues {
  int max_side_px = 0;  // of all working pictures
  v1::SelectKeyViewSpec::Strategy strategy = v1::SelectKeyViewSpec::STRATEGY_COVERAGE;
  v1::PersonalizeSpec::Recipe recipe = v1::PersonalizeSpec::RECIPE_COLOR3D;
  int personalize_iterations = 0;
  double least_improvement = 0.0;  // below, personalization stops early; 0: never
  int augmentation_samples = 0;    // made from the key view; files of the user's come on top
  v1::ReconstructGeometrySpec::Recipe geometry_recipe = v1::ReconstructGeometrySpec::RECIPE_COLOR3D;
  int geometry_iterations = 0;
  int max_gaussians = 0;
  int sh_degree = 2;  // of luminance
  double densify_gradient = 5e-5;
  v1::SolveChromaSpec::Solver chroma_solver = v1::SolveChromaSpec::SOLVER_CONJUGATE_GRADIENTS;
  int chroma_iterations = 0;  // of Adam
};

// PRESET_UNSPECIFIED is PRESET_FAST.
PresetValues ValuesOf(v1::Preset preset);

}  // namespace color3d
