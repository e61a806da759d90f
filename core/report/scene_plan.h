// The scene plan: every step of the method, needed or left out, with the reason and the cost. Made
// before work starts, completed with measured seconds afterwards.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace color3d {

// What the geometry of a scene with times and poses has found.
struct SceneMotion {
  bool moves = false;           // else it was reconstructed as one that stands still
  std::optional<double> share;  // the motion energy: of all pixels, those that move, 0..1
};
// "static", "partly dynamic" or, where half of the pixels move, "fully dynamic"; empty where
// something moves and nobody has measured how much.
std::string ClassOf(const SceneMotion& motion);

struct PlanStep {
  std::string step;  // e.g. "structure_from_motion"
  bool needed = true;
  std::string reason;  // one sentence
  // On this machine's threads; of a step that is left out: what that saves.
  double estimated_seconds = 0.0;
  double measured_seconds = -1.0;  // < 0: not run, or not measured on its own
  // Kind of the stage whose time the step takes; empty when it is only a part of one. Not in the
  // file.
  std::string stage = {};
  std::optional<SceneMotion> motion = {};  // that `needed` goes by
};

// What the plan depends on.
struct PlanFacts {
  bool has_poses = false;
  bool has_distortion = false;
  bool has_sparse_points = true;
  bool geometry_given = false;             // the scene is a splat
  bool is_film = false;                    // frames without poses: nothing is reconstructed
  bool is_dynamic = false;                 // several times with poses
  int time_steps = 0;                      // of a dynamic scene
  int cameras = 0;                         // of a dynamic scene
  std::optional<SceneMotion> motion = {};  // of a dynamic scene, once there is geometry
  bool has_truth = false;
  bool key_view_given = false;
  int views = 0;
  double megapixels_per_view = 0.0;  // at working size
};

std::vector<PlanStep> PlanScene(const PlanFacts& facts);

std::string PlanToJson(const std::vector<PlanStep>& steps);

}  // namespace color3d
