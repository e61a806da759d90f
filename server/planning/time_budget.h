// How a time budget for a whole scene is divided among the stages whose schedules can be shortened.
// Pure arithmetic on estimates; the stages hold themselves to their shares.
#pragma once

#include <string_view>

namespace color3d {

// Pictures in colour that the user gives for the colorizer to learn from: no photos of the scene.
inline bool IsAugmentFile(std::string_view path) { return path.starts_with("augment/"); }

// What the planner knows of a scene before it is imported.
struct SceneFacts {
  int photos = 0;
  bool has_poses = false;
  int augment_files = 0;
};

struct TimeBudget {
  double geometry_seconds = 0.0;
  double personalize_seconds = 0.0;
  double chroma_seconds = 0.0;
};

// Seconds that the stages without a schedule take on two cores: poses, colouring every view,
// export, renders, report.
double FixedSeconds(const SceneFacts& facts);

// Throws ServiceError{kInvalidArgument, BAD_OPTION} naming the least that works when `seconds`
// leave nothing for the rest.
TimeBudget DivideTimeBudget(double seconds, const SceneFacts& facts);

}  // namespace color3d
