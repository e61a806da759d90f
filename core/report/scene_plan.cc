#include "core/report/scene_plan.h"

#include <fmt/core.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "core/catalogue/estimates.h"
#include "core/catalogue/stages.h"

namespace color3d {
namespace {

// Measured on two cores. The report shows measured seconds beside these estimates.
constexpr double kSecondsPerRemapMegapixel = 0.01;
constexpr double kSecondsPerFeatureMegapixel = 0.5;
constexpr double kFullyDynamic = 0.5;  // motion energy

std::string WhyKeyView(const PlanFacts& f) {
  if (f.key_view_given) return "the key view was given";
  if (f.key_view_strategy.empty()) return "the key view is chosen among the views";
  return "the key view is chosen by " + f.key_view_strategy;
}

std::string WhyTime(const PlanFacts& f) {
  if (f.is_film) return "nothing is reconstructed of a film";
  if (!f.is_dynamic) return "all photos show one time";
  std::string why = fmt::format("the views show {} time steps, seen by {} camera{}",
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
  return {
      .step = "deformation_over_time", .needed = needed, .reason = WhyTime(f), .motion = f.motion};
}

}  // namespace

std::string ClassOf(const SceneMotion& motion) {
  if (!motion.moves) return "static";
  if (!motion.share) return "";
  return *motion.share < kFullyDynamic ? "partly dynamic" : "fully dynamic";
}

std::vector<PlanStep> PlanScene(const PlanFacts& f) {
  const double megapixels = f.views * f.megapixels_per_view;
  const char* film = "nothing is reconstructed of a film";
  std::vector<PlanStep> plan;
  const auto add = [&plan](const char* step,
                           bool needed,
                           std::string reason,
                           const char* stage = "",
                           double seconds = 0.0) {
    plan.push_back({step, needed, std::move(reason), seconds, -1.0, stage});
  };
  add("structure_from_motion",
      !f.has_poses && !f.is_film,
      f.is_film     ? "frames of a film are coloured along the optical flow"
      : f.has_poses ? "the scene comes with camera poses"
                    : "the photos come without camera poses",
      kind::kImportScene,
      kPosesSecondsPerPhoto * f.views);
  add("undistortion",
      f.has_distortion,
      f.has_distortion ? "the cameras have lens distortion" : "no camera has lens distortion",
      "",
      kSecondsPerRemapMegapixel * megapixels);
  add("random_points",
      !f.has_sparse_points && !f.is_film,
      f.is_film             ? film
      : f.has_sparse_points ? "the scene has sparse points to start from"
                            : "the scene has no sparse points to start from",
      "",
      0.1);
  add("key_view_selection",
      !f.key_view_given,
      WhyKeyView(f),
      kind::kSelectKeyView,
      kSecondsPerFeatureMegapixel * megapixels);
  add("key_view_color",
      true,
      "all colours of the scene come from its key views",
      kind::kColorizeKeyView);
  add("luminance_geometry",
      !f.geometry_given && !f.is_film,
      f.is_film          ? film
      : f.geometry_given ? "the scene's Gaussians were given"
                         : "every scene needs geometry",
      kind::kReconstructGeometry);
  add("carried_color",
      true,
      f.is_film ? "colours are carried along the optical flow"
                : "colours are carried to every view that sees the same surface",
      kind::kCarryColor);
  add("augmentations",
      f.has_augmentations,
      f.has_augmentations ? "the colorizer also learns from generated pictures"
                          : "the colorizer learns from the key views alone",
      kind::kGenerateAugmentations);
  add("personalization",
      true,
      "surfaces that no key view shows get the colours of similar ones",
      kind::kPersonalize);
  add("view_colors", true, "every view gets a colour at every pixel", kind::kColorizeViews);
  add("corrections",
      f.has_corrections,
      f.has_corrections ? "corrections were given" : "nothing is to be corrected",
      kind::kCorrectColors);
  add("chroma",
      !f.is_film,
      f.is_film ? film : "a and b are fitted on the finished geometry",
      kind::kSolveChroma);
  add("warm_up_in_three_channels",
      false,
      "three equal luminance channels are one channel: one is rasterised");
  add("view_dependent_chroma",
      false,
      "chroma hardly depends on the direction: degree 0 suffices unless another is asked for");
  plan.push_back(TimeStep(f));
  add("export", !f.is_film, f.is_film ? film : "viewers read files of their own", kind::kExport);
  add("render",
      true,
      f.is_film ? "the coloured frames become a film" : "the report shows rendered views",
      kind::kRender);
  add("evaluation",
      true,
      f.has_truth ? "true colours of held-out views were given"
                  : "no true colours were given: the views are compared with each other only",
      kind::kEvaluate);
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
    if (s.motion && !ClassOf(*s.motion).empty()) entry["motion"] = ClassOf(*s.motion);
    if (s.motion && s.motion->share) entry["moving_share"] = *s.motion->share;
    array.push_back(std::move(entry));
  }
  return array.dump(1) + "\n";
}

}  // namespace color3d
