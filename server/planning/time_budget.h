// Divides the time budget of a scene among the stages whose schedules can be shortened. Pure
// arithmetic on estimates; the stages keep to their shares.
#pragma once

#include "color3d/v1/job.pb.h"
#include "server/planning/scene_facts.h"

namespace color3d {

// Views that the import will make, as far as they are known.
struct ExpectedViews {
  int count = 0;
  bool is_counted = false;  // the frames of video files are not counted before the import
  const char* noun = "photos";
  const char* fewer = ", or fewer photos";  // remedy of a budget that is too short
  CaptureKind kind = CaptureKind::kStatic;
  bool are_frames = false;
  bool have_geometry = false;
  bool are_reconstructed = true;
};
ExpectedViews ViewsOf(const SceneFacts& facts, const v1::ImportSceneSpec& import);

struct TimeBudget {
  double geometry_seconds = 0.0;
  double personalize_seconds = 0.0;
  double chroma_seconds = 0.0;
};

// Estimated seconds (core/catalogue/cost_model.h) of the stages without a schedule at 500 px:
// poses, colouring of every view, renders, scores, report. Frames of video files do not count:
// their number is unknown before the import. `import`: number of views of a splat, frames of a
// film, search for their poses.
double FixedSeconds(const SceneFacts& facts, const v1::ImportSceneSpec& import = {});

// Smallest budget that DivideTimeBudget accepts, whole seconds.
double ShortestTimeBudget(const SceneFacts& facts, const v1::ImportSceneSpec& import);

// Throws ServiceError{kInvalidArgument, BAD_OPTION} with the smallest possible budget if `seconds`
// leaves too little for the stages with a schedule.
TimeBudget DivideTimeBudget(double seconds,
                            const SceneFacts& facts,
                            const v1::ImportSceneSpec& import);

// Sets the time limit of a stage to its share, at most the limit's maximum. A limit that is set is
// kept.
void ApplyTimeBudget(const TimeBudget& budget, v1::JobSpec* spec);

}  // namespace color3d
