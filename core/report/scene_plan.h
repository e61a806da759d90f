// The plan of a scene: every step of the method, needed or left out, with reason and cost. Pure
// functions and values.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/catalogue/captures.h"

namespace color3d {

// Motion that the geometry stage found in a scene with times and poses.
struct SceneMotion {
  bool moves = false;           // false: reconstructed as a static scene
  std::optional<double> share;  // motion energy: share of the pixels that move, 0..1
};
// "static", "partly dynamic" or, if half of the pixels move, "fully dynamic"; empty if something
// moves and the share was not measured.
std::string MotionClass(const SceneMotion& motion);

struct PlanStep {
  std::string step;  // e.g. "structure_from_motion"
  bool needed = true;
  std::string reason;              // one sentence
  double estimated_seconds = 0.0;  // on two cores; for steps that are left out, the time saved
  double measured_seconds = -1.0;  // < 0: not run, or not measured on its own
  // Kind of the stage that the step is; empty if it is a part of one. Not in the file.
  std::string stage = {};
  std::optional<SceneMotion> motion = {};  // that decides on `needed`
  // Peak memory; for steps that are left out, the bytes by which this lowers the peak of the run.
  int64_t estimated_memory_bytes = 0;  // 0: unknown, or none
  int64_t measured_memory_bytes = 0;   // 0: not run, or not measured
};

// Decoder that was not trained, because the neighbours agree.
struct UntrainedDecoder {
  double share = 0.0;  // that it would have of the inferred colours, 0..1
  int iterations = 0;  // of the training
};

struct PlanFacts {
  bool has_poses = false;
  bool has_distortion = false;
  bool has_sparse_points = true;
  bool geometry_given = false;  // the scene is a splat
  CaptureKind kind = CaptureKind::kStatic;
  int time_steps = 0;                      // dynamic scenes only
  int cameras = 0;                         // dynamic scenes only
  std::optional<SceneMotion> motion = {};  // dynamic scenes only, once there is geometry
  bool has_truth = false;
  bool has_augmentations = false;
  bool has_corrections = false;
  bool key_view_given = false;
  std::string key_view_strategy = {};  // in words, e.g. "feature coverage"; empty: unknown
  std::optional<UntrainedDecoder> untrained_decoder = {};
  int views = 0;
  double megapixels_per_view = 0.0;  // at working size
};

// In the order of the pipeline; every stage of core/catalogue/stages.h is a step, but not the kinds
// that are graphs of others.
std::vector<PlanStep> PlanScene(const PlanFacts& facts);

// Marks the step of a stage as left out, because the planner skipped the stage.
void SkipStep(const std::string& stage, const std::string& reason, std::vector<PlanStep>* plan);

std::string PlanToJson(const std::vector<PlanStep>& steps);

}  // namespace color3d
