// Views with times that are held out for evaluation, and how far each is from the training views.
#pragma once

#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// How a view is held out of training.
enum class HoldOutKind {
  kNot,     // a training view, or a view without a time
  kCamera,  // its camera has no training view
  kMoment,  // its time has no training view; the times before and after it have
  kBlock,   // a run of two or more times, its own among them, has no training view
};
// "camera", "moment" or "block"; "" for kNot.
const char* NameOf(HoldOutKind how);

// Returns one entry for each view. Shots of a film without poses do not count as cameras.
std::vector<HoldOutKind> HeldOutKinds(const Scene& scene);

// Holds out all views of a run of times in the middle of the scene: `share`, 0..0.5, of its
// distinct times. Call it after all other ways of holding out. Throws Error{kInvalidArgument} with
// the remedy if views have no times, the run has fewer than two times, or fewer than two training
// times are left on either side.
void HoldOutBlock(double share, Scene* scene);

}  // namespace color3d
