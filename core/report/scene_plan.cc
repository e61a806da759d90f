#include "core/report/scene_plan.h"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/catalogue/stages.h"

namespace color3d {
namespace {

// Rough costs measured on two cores (seconds); the report sets measured ones beside them.
constexpr double kSecondsPerSfmPair = 0.1;
constexpr double kSecondsPerRemapMegapixel = 0.01;
constexpr double kSecondsPerFeatureMegapixel = 0.5;
constexpr double kFullyDynamic = 0.5;  // motion energy

double SfmSeconds(const PlanFacts& f) {
  // Planned pairs: about six a photo, or all of a small set.
  const double pairs = std::min(f.views * (f.views - 1) / 2.0, 6.0 * f.views);
  return 0.3 * f.views + kSecondsPerSfmPair * pairs;
}

PlanStep Step(
    std::string name, bool needed, std::string reason, double seconds, std::string stage = "") {
  return {std::move(name), needed, std::move(reason), seconds, -1.0, std::move(stage)};
}

std::string WhyTime(const PlanFacts& f) {
  if (f.is_film) return "nothing is reconstructed of a film";
  if (!f.is_dynamic) return "all photos show one moment";
  std::string why = fmt::format("the views show {} moments, seen by {} camera{}",
                                f.time_steps,
                                f.cameras,
                                f.cameras == 1 ? "" : "s");
  if (!f.motion) return why;
  const std::string found = ClassOf(*f.motion);
  if (!f.motion->moves) return why + "; " + found + ": nothing moves in their geometry";
  if (!f.motion->share) return why + "; something moves in their geometry";
  return why + fmt::format("; {}: {:.1f} % of the pixels move", found, 100.0 * *f.motion->share);
}

PlanStep TimeStep(const PlanFacts& f) {
  const bool needed = f.is_dynamic && !f.is_film && (!f.motion || f.motion->moves);
  PlanStep step = Step("deformation_over_time", needed, WhyTime(f), 0.0);
  step.motion = f.motion;
  return step;
}

}  // namespace

std::string ClassOf(const SceneMotion& motion) {
  if (!motion.moves) return "static";
  if (!motion.share) return "";
  return *motion.share < kFullyDynamic ? "partly dynamic" : "fully dynamic";
}

std::vector<PlanStep> PlanScene(const PlanFacts& f) {
  const double megapixels = f.views * f.megapixels_per_view;
  std::vector<PlanStep> plan;
  plan.push_back(Step("structure_from_motion",
                      !f.has_poses && !f.is_film,
                      f.is_film     ? "frames of a film are coloured by motion"
                      : f.has_poses ? "the scene comes with camera poses"
                                    : "the photos come without camera poses",
                      SfmSeconds(f),
                      kind::kImportScene));
  plan.push_back(
      Step("undistortion",
           f.has_distortion,
           f.has_distortion ? "the cameras have lens distortion" : "no camera has lens distortion",
           kSecondsPerRemapMegapixel * megapixels));
  plan.push_back(Step("random_points",
                      !f.has_sparse_points && !f.is_film,
                      f.is_film             ? "nothing is reconstructed of a film"
                      : f.has_sparse_points ? "the scene has sparse points to start from"
                                            : "the scene has no sparse points to start from",
                      0.1));
  plan.push_back(Step(
      "key_view_selection",
      !f.key_view_given,
      f.key_view_given ? "the key view was given" : "the key view is chosen by feature coverage",
      kSecondsPerFeatureMegapixel * megapixels,
      kind::kSelectKeyView));
  plan.push_back(Step("luminance_geometry",
                      !f.geometry_given && !f.is_film,
                      f.is_film          ? "nothing is reconstructed of a film"
                      : f.geometry_given ? "the scene's Gaussians were given"
                                         : "every scene needs geometry",
                      0.0,
                      kind::kReconstructGeometry));
  plan.push_back(Step("personalization",
                      true,
                      "the key view's colours must reach every view",
                      0.0,
                      kind::kPersonalize));
  plan.push_back(Step("chroma",
                      !f.is_film,
                      f.is_film ? "nothing is reconstructed of a film"
                                : "a and b are fitted on the finished geometry",
                      0.0,
                      kind::kSolveChroma));
  plan.push_back(Step("warm_up_in_three_channels",
                      false,
                      "three identical luminance channels are one channel: one is rasterised",
                      0.0));
  plan.push_back(Step("view_dependent_chroma",
                      false,
                      "chroma is low-frequency in angle: degree 0 suffices unless asked for",
                      0.0));
  plan.push_back(TimeStep(f));
  plan.push_back(
      Step("evaluation",
           true,
           f.has_truth ? "true colours of held-out views were given"
                       : "no true colours were given: the views are compared with each other only",
           0.0,
           kind::kEvaluate));
  return plan;
}

std::string PlanToJson(const std::vector<PlanStep>& steps) {
  nlohmann::ordered_json array = nlohmann::ordered_json::array();
  for (const PlanStep& s : steps) {
    nlohmann::ordered_json entry{{"step", s.step},
                                 {"needed", s.needed},
                                 {"reason", s.reason},
                                 {"estimated_seconds", s.estimated_seconds}};
    if (s.measured_seconds >= 0.0) entry["measured_seconds"] = s.measured_seconds;
    if (s.motion && !ClassOf(*s.motion).empty()) entry["motion"] = ClassOf(*s.motion);
    if (s.motion && s.motion->share) entry["moving_share"] = *s.motion->share;
    array.push_back(std::move(entry));
  }
  return array.dump(1) + "\n";
}

}  // namespace color3d
