#include "core/report/scene_plan.h"

#include <fmt/core.h>

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/catalogue/cost_model.h"
#include "core/catalogue/estimates.h"
#include "core/catalogue/stages.h"

namespace color3d {
namespace {

// Measured on two cores. The report shows measured seconds beside these estimates.
constexpr double kSecondsPerRemapMegapixel = 0.01;
constexpr double kFullyDynamic = 0.5;  // motion energy

// Steps that do something else for a kind of capture.
struct StepOfKind {
  CaptureKind kind;
  const char* stage;
  bool needed;
  const char* reason;
};

constexpr StepOfKind kStepsOfKinds[] = {
    {CaptureKind::kFilm,
     kind::kImportScene,
     false,
     "frames of a film are coloured along the optical flow"},
    {CaptureKind::kFilm, kind::kCarryColor, true, "colours are carried along the optical flow"},
    {CaptureKind::kFilm, kind::kRender, true, "the coloured frames become a film"},
    {CaptureKind::kPictures,
     kind::kCarryColor,
     true,
     "colours are carried to the planes that local features find in other photos"},
    {CaptureKind::kPictures, kind::kRender, true, "the coloured photos are written"}};

// "" if the scene is reconstructed.
std::string_view WhyNotReconstructed(const PlanFacts& f) {
  return WhyNothingToDo(f.kind, kind::kReconstructGeometry);
}

std::string MotionReason(const PlanFacts& f) {
  const std::string_view why_not = WhyNotReconstructed(f);
  if (!why_not.empty()) return std::string(why_not);
  if (f.time_steps == 0) return "all photos show one time";
  std::string why = fmt::format("the views show {} time steps, seen by {} camera{}",
                                f.time_steps,
                                f.cameras,
                                f.cameras == 1 ? "" : "s");
  if (!f.motion) return why;
  const std::string found = MotionClass(*f.motion);
  if (!f.motion->moves) return why + "; " + found + ": nothing moves in their geometry";
  if (!f.motion->share) return why + "; something moves in their geometry";
  return why + fmt::format("; {}: {:.1f} % of the pixels move", found, 100.0 * *f.motion->share);
}

PlanStep TimeStep(const PlanFacts& f) {
  const bool needed =
      f.time_steps > 0 && WhyNotReconstructed(f).empty() && (!f.motion || f.motion->moves);
  return {.step = "deformation_over_time",
          .needed = needed,
          .reason = MotionReason(f),
          .motion = f.motion};
}

// Adapts the step of a stage, as the catalogue has it, to the scene.
void Decide(const PlanFacts& f, PlanStep* step) {
  const auto leave_out = [step](std::string_view reason) {
    step->needed = false;
    step->reason = reason;
  };
  if (step->stage == kind::kImportScene) {
    step->estimated_seconds = kPosesSecondsPerPhoto * f.views;
    if (f.has_poses) leave_out("the scene comes with camera poses");
  } else if (step->stage == kind::kSelectKeyView) {
    step->estimated_seconds =
        EstimateSeconds(step->stage, {.views = f.views, .megapixels = f.megapixels_per_view});
    if (!f.key_view_strategy.empty()) {
      step->reason = "the key view is chosen by " + f.key_view_strategy;
    }
    if (f.key_view_given) leave_out("the key view was given");
  } else if (step->stage == kind::kReconstructGeometry) {
    if (f.geometry_given) leave_out("the scene's Gaussians were given");
  } else if (step->stage == kind::kGenerateAugmentations) {
    if (!f.has_augmentations) leave_out("the colorizer learns from the key views alone");
  } else if (step->stage == kind::kCorrectColors) {
    if (!f.has_corrections) leave_out("no corrections were given");
  } else if (step->stage == kind::kEvaluate) {
    step->reason = f.has_truth
                       ? "true colours of held-out views were given"
                       : "no true colours were given: the views are compared with each other only";
  }
  for (const StepOfKind& other : kStepsOfKinds) {
    if (other.kind != f.kind || other.stage != step->stage) continue;
    step->needed = other.needed;
    step->reason = other.reason;
  }
  const std::string_view why_idle = WhyNothingToDo(f.kind, step->stage);
  if (!why_idle.empty()) leave_out(why_idle);
}

// Parts of the stage that may be left out.
void AddParts(const PlanFacts& f, const std::string& stage, std::vector<PlanStep>* plan) {
  const auto add =
      [plan](const char* step, bool needed, std::string_view reason, double seconds = 0.0) {
        plan->push_back({.step = step,
                         .needed = needed,
                         .reason = std::string(reason),
                         .estimated_seconds = seconds});
      };
  if (stage == kind::kImportScene) {
    const std::string_view why_not = WhyNotReconstructed(f);
    add("undistortion",
        f.has_distortion,
        f.has_distortion ? "the cameras have lens distortion" : "no camera has lens distortion",
        kSecondsPerRemapMegapixel * f.views * f.megapixels_per_view);
    add("random_points",
        !f.has_sparse_points && why_not.empty(),
        !why_not.empty()      ? why_not
        : f.has_sparse_points ? "the scene has sparse points to start from"
                              : "the scene has no sparse points to start from",
        0.1);
  } else if (stage == kind::kReconstructGeometry) {
    add("warm_up_in_three_channels",
        false,
        "three equal luminance channels are one channel: one is rasterised");
    plan->push_back(TimeStep(f));
  } else if (stage == kind::kPersonalize && f.untrained_decoder) {
    add("decoder_training",
        false,
        fmt::format("the neighbours agree: a decoder would have {:.1f} % of the inferred colours",
                    100.0 * f.untrained_decoder->share),
        EstimateSeconds(stage, {.iterations = f.untrained_decoder->iterations}) -
            EstimateSeconds(stage, {}));
  } else if (stage == kind::kSolveChroma) {
    add("view_dependent_chroma",
        false,
        "chroma hardly depends on the direction: degree 0 suffices unless another is requested");
  }
}

}  // namespace

std::string MotionClass(const SceneMotion& motion) {
  if (!motion.moves) return "static";
  if (!motion.share) return "";
  return *motion.share < kFullyDynamic ? "partly dynamic" : "fully dynamic";
}

std::vector<PlanStep> PlanScene(const PlanFacts& f) {
  std::vector<PlanStep> plan;
  for (const Stage& stage : StageCatalogue()) {
    if (stage.step == nullptr) continue;
    PlanStep step{.step = stage.step, .reason = stage.purpose, .stage = stage.kind};
    Decide(f, &step);
    plan.push_back(std::move(step));
    AddParts(f, stage.kind, &plan);
  }
  return plan;
}

void SkipStep(const std::string& stage, const std::string& reason, std::vector<PlanStep>* plan) {
  for (PlanStep& step : *plan) {
    if (step.stage != stage) continue;
    step.needed = false;
    step.reason = reason;
  }
}

std::string PlanToJson(const std::vector<PlanStep>& steps) {
  nlohmann::ordered_json array = nlohmann::ordered_json::array();
  for (const PlanStep& s : steps) {
    nlohmann::ordered_json entry{{"step", s.step},
                                 {"needed", s.needed},
                                 {"reason", s.reason},
                                 {"estimated_seconds", s.estimated_seconds}};
    if (s.measured_seconds >= 0.0) entry["measured_seconds"] = s.measured_seconds;
    if (s.estimated_memory_bytes > 0) entry["estimated_memory_bytes"] = s.estimated_memory_bytes;
    if (s.measured_memory_bytes > 0) entry["measured_memory_bytes"] = s.measured_memory_bytes;
    if (s.motion && !MotionClass(*s.motion).empty()) entry["motion"] = MotionClass(*s.motion);
    if (s.motion && s.motion->share) entry["moving_share"] = *s.motion->share;
    array.push_back(std::move(entry));
  }
  return array.dump(1) + "\n";
}

}  // namespace color3d
