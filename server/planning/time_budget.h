// Divides the time budget of a scene among the stages whose schedules can be shortened. Pure
// arithmetic on estimates; the stages keep to their shares.
#pragma once

#include "color3d/v1/job.pb.h"
#include "server/planning/scene_facts.h"

namespace color3d {

struct TimeBudget {
  double geometry_seconds = 0.0;
  double personalize_seconds = 0.0;
  double chroma_seconds = 0.0;
};

// Estimated seconds of the stages without a schedule on two cores: poses, colouring of every view,
// export, renders, report. Frames of video files do not count: their number is unknown before the
// import. `import`: number of views of a splat, frames of a film, search for their poses.
double FixedSeconds(const SceneFacts& facts, const v1::ImportSceneSpec& import = {});

// Throws ServiceError{kInvalidArgument, BAD_OPTION} with the smallest possible budget if `seconds`
// leaves too little for the stages with a schedule.
TimeBudget DivideTimeBudget(double seconds,
                            const SceneFacts& facts,
                            const v1::ImportSceneSpec& import);

// Sets the time limit of a stage to its share, at most the limit's maximum. A limit that is set is
// kept.
void ApplyTimeBudget(const TimeBudget& budget, v1::JobSpec* spec);

}  // namespace color3d
