#include "core/catalogue/stages.h"

#include "core/base/error.h"
#include "core/catalogue/artifacts.h"

namespace color3d {
namespace {

std::vector<Stage> WithArtifacts(std::vector<Stage> stages) {
  for (Stage& stage : stages) {
    for (const Artifact& artifact : ArtifactCatalogue()) {
      if (artifact.stage == nullptr || std::string_view(artifact.stage) != stage.kind) continue;
      stage.outputs.push_back(artifact.name);
      if (artifact.is_result) stage.results.push_back(artifact.name);
    }
  }
  return stages;
}

}  // namespace

const std::vector<Stage>& StageCatalogue() {
  using namespace artifact;
  using namespace kind;
  static const std::vector<Stage> catalogue = WithArtifacts({
      {.kind = kImportScene,
       .step = "structure_from_motion",
       .purpose = "the photos come without camera poses"},
      {.kind = kSelectKeyView,
       .step = "key_view_selection",
       .purpose = "the key view is chosen among the views",
       .needs = {kScene},
       .reads = {kImportFacts, kGeometry},  // the latter of an earlier job
       .brings_prerequisites = true},
      {.kind = kColorizeKeyView,
       .step = "key_view_color",
       .purpose = "all colours of the scene come from its key views",
       .needs = {kScene, kKeyView},  // kKeyView for the first key view only
       .brings_prerequisites = true},
      {.kind = kReconstructGeometry,
       .step = "luminance_geometry",
       .purpose = "every scene needs geometry",
       .needs = {kScene},
       .reads = {kGivenGeometry, kMovingRegions},  // the former in place of training
       .brings_prerequisites = true,
       .resumes = true,
       .keeps_time_limit = true},
      {.kind = kCarryColor,
       .step = "carried_color",
       .purpose = "colours are carried to every view that sees the same surface",
       .needs = {kScene, kKeyView, kKeyColor, kGeometry},
       .reads = {kKeyViews, kKeyColorFacts},
       .resumes = true},
      {.kind = kGenerateAugmentations,
       .step = "augmentations",
       .purpose = "the colorizer also learns from generated pictures",
       .needs = {kScene, kKeyView, kKeyColor},
       .reads = {kGeometry, kCarryFacts}},
      {.kind = kPersonalize,
       .step = "personalization",
       .purpose = "surfaces that no key view shows get the colours of similar ones",
       .needs = {kScene, kKeyView, kKeyColor},
       .reads = {kAugmentationFacts, kAugmentations, kCarried, kGeometry, kKeyViews},
       .runs_in_batch = true,
       .resumes = true,
       .keeps_time_limit = true},
      {.kind = kColorizeViews,
       .step = "view_colors",
       .purpose = "every view gets a colour at every pixel",
       .needs = {kScene, kColorizer},
       // The last three: methods without carried colours, and recolouring.
       .reads = {kCarried, kCarryFacts, kGeometry, kKeyView, kKeyColor, kKeyViews},
       .resumes = true},
      {.kind = kCorrectColors,
       .step = "corrections",
       .purpose = "corrections were given",
       .needs = {kScene, kKeyView, kKeyColor, kColorizer, kViewsAb},
       .reads = {kGeometry, kProvenance, kKeyViews}},
      {.kind = kSolveChroma,
       .step = "chroma",
       .purpose = "a and b are fitted on the finished geometry, or trained together with it",
       .needs = {kScene, kKeyView, kKeyColor, kViewsAb, kGeometry},
       .reads = {kWarmUp, kProvenance, kCorrectedAb, kCorrectedProvenance},
       .resumes = true,
       .keeps_time_limit = true},
      {.kind = kExport,
       .step = "export",
       .purpose = "viewers read files of their own",
       .needs = {kScene, kModel},
       .reads = {kKeyView, kImportFacts}},
      {.kind = kRender,
       .step = "render",
       .purpose = "the report shows rendered views",
       .needs = {kScene, kModel},
       // the reads: for films and dynamic scenes
       .reads = {kKeyView, kKeyColor, kViewsAb, kCorrectedAb, kImportFacts}},
      {.kind = kEvaluate,
       .step = "evaluation",
       .purpose = "the views are compared with true colours or with each other",
       .needs = {kScene, kViewsAb, kModel},
       .reads = {kKeyView, kKeyColor, kProvenance, kCorrectedAb, kCorrectedProvenance}},
      {.kind = kColorizeScene},  // its report reads the artifacts of all others
      {.kind = kPersonalizeScenes},
  });
  return catalogue;
}

const Stage* FindStage(std::string_view kind) {
  for (const Stage& stage : StageCatalogue()) {
    if (kind == stage.kind) return &stage;
  }
  return nullptr;
}

const Stage& StageOf(std::string_view kind) {
  const Stage* stage = FindStage(kind);
  if (stage == nullptr) {
    throw Error(ErrorCode::kInternal, "there is no stage '{}'", kind);
  }
  return *stage;
}

const Stage* FindProducer(std::string_view artifact) {
  const Artifact* found = FindArtifact(artifact);
  return found != nullptr && found->stage != nullptr ? FindStage(found->stage) : nullptr;
}

}  // namespace color3d
