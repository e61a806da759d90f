// Views with times that are held out for evaluation, and how far each is from the training views.
#pragma once

#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// How a view is held out of training.
enum class HoldOutKind {
  kNot,     // it is a training view, or has no time
  kCamera,  // no view of its camera is a training view
  kMoment,  // no view of its moment is; views of the moments before and after it are
  kBlock,   // no view of a run of two or more moments is, its own among them
};
// "camera", "moment" or "block"; "" for kNot.
const char* NameOf(HoldOutKind how);

// Returns one entry for each view. Shots of a film without poses do not count as cameras.
std::vector<HoldOutKind> HeldOutKinds(const Scene& scene);

// Holds out all views of a run of moments in the middle of the scene's time: `share`, 0..0.5, of
// all moments. Call it after all other ways of holding out. Throws Error{kInvalidArgument} with the
// remedy if views have no times, the run has fewer than two moments, or fewer than two training
// moments are left on either side.
void HoldOutBlock(double share, Scene* scene);

}  // namespace color3d
