// Which views of a scene whose views have times are kept for scoring, and how far each is from what
// is learnt from.
#pragma once

#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// Why nothing is learnt from a view.
enum class HeldOutAs {
  kNot,     // it is learnt from, or has no time
  kCamera,  // nothing is learnt from its camera
  kMoment,  // ... from any view of its moment, but from the moments before and behind it
  kBlock,   // ... from a run of two moments or more, of which its own is one
};
// "camera", "moment" or "block"; "" for kNot.
const char* NameOf(HeldOutAs how);

// Of each view. Shots of a film without poses are no cameras.
std::vector<HeldOutAs> HowHeldOut(const Scene& scene);

// Marks all views of a run of moments as held out: `share`, 0..0.5, of all moments, in the middle
// of the scene's time. Comes after whatever else is held out. Throws Error{kInvalidArgument} with
// the remedy: the views have no times, the run has less than two moments, less than two moments to
// learn from are left on either side of it.
void HoldOutBlock(double share, Scene* scene);

}  // namespace color3d
