// How a time budget for a whole scene is divided among the stages whose schedules can be shortened.
// Pure arithmetic on estimates; the stages hold themselves to their shares.
#pragma once

#include "color3d/v1/job.pb.h"
#include "server/planning/scene_facts.h"

namespace color3d {

struct TimeBudget {
  double geometry_seconds = 0.0;
  double personalize_seconds = 0.0;
  double chroma_seconds = 0.0;
};

// Seconds that the stages without a schedule take on two cores: poses, colouring every view,
// export, renders, report. Without the frames of video files, which are not counted before they are
// imported. `import`: which frames of a film are taken, and whether their poses are looked for.
double FixedSeconds(const SceneFacts& facts, const v1::ImportSceneSpec& import = {});

// Throws ServiceError{kInvalidArgument, BAD_OPTION} naming the least that works when `seconds`
// leave nothing for the rest.
TimeBudget DivideTimeBudget(double seconds,
                            const SceneFacts& facts,
                            const v1::ImportSceneSpec& import);

// Writes a stage's share into its options, at most what they take as a time limit, unless they
// have one of their own.
void ApplyTimeBudget(const TimeBudget& budget, v1::JobSpec* spec);

}  // namespace color3d
