#include "core/catalogue/stages.h"

#include "core/base/error.h"
#include "core/catalogue/artifacts.h"

namespace color3d {

const std::vector<Stage>& StageCatalogue() {
  using namespace artifact;
  static const std::vector<Stage> catalogue = {
      {.kind = kind::kImportScene,
       .leaves = {kScene, kImportFacts, kSfmLog, kGivenViews, kMovingRegions, kGivenGeometry},
       .results = {kSfmLog}},
      {.kind = kind::kSelectKeyView,
       .needs = {kScene},
       .reads = {kImportFacts, kGeometry},  // geometry of an earlier job, if it is given one
       .leaves = {kKeyView, kKeyViewGray, kKeyViewRanking},
       .results = {kKeyView, kKeyViewGray, kKeyViewRanking},
       .brings_prerequisites = true},
      {.kind = kind::kColorizeKeyView,
       .needs = {kScene, kKeyView},
       // For an additional key view kKeyView is not needed; other stages read its artifacts below
       // kKeyViews.
       .leaves = {kKeyColor, kKeyColorFacts, kKeyColorRegions, kKeyViewColored, kKeyViews},
       .results = {kKeyColorFacts, kKeyColorRegions, kKeyViewColored, kKeyViews},
       .brings_prerequisites = true},
      {.kind = kind::kReconstructGeometry,
       .needs = {kScene},
       .reads = {kGivenGeometry, kMovingRegions},  // the former in place of training
       .leaves = {kGeometry, kMemoryPlan},
       .brings_prerequisites = true,
       .resumes = true,
       .keeps_time_limit = true},
      {.kind = kind::kCarryColor,
       .needs = {kScene, kKeyView, kKeyColor, kGeometry},
       .reads = {kKeyViews},
       .leaves = {kCarried, kCarryFacts},
       .resumes = true},
      {.kind = kind::kGenerateAugmentations,
       .needs = {kScene, kKeyView, kKeyColor},
       .reads = {kGeometry, kCarryFacts},
       .leaves = {kAugmentationFacts, kAugmentations, kAugmentationSheet},
       .results = {kAugmentationSheet}},
      {.kind = kind::kPersonalize,
       .needs = {kScene, kKeyView, kKeyColor},
       .reads = {kAugmentationFacts, kAugmentations, kCarried, kGeometry},
       .leaves = {kColorizer},
       .results = {kColorizer},
       .runs_in_batch = true,
       .resumes = true,
       .keeps_time_limit = true},
      {.kind = kind::kColorizeViews,
       .needs = {kScene, kColorizer},
       .reads = {kCarried, kCarryFacts, kGeometry},
       .leaves = {kViewsAb, kProvenance},
       .resumes = true},
      {.kind = kind::kCorrectColors,
       .needs = {kScene, kKeyView, kKeyColor, kColorizer, kViewsAb},
       .reads = {kGeometry, kProvenance, kKeyViews},
       .leaves = {kCorrectedAb, kCorrectedProvenance, kCorrections, kPaint},
       .results = {kCorrections, kPaint}},
      {.kind = kind::kSolveChroma,
       .needs = {kScene, kKeyView, kKeyColor, kViewsAb, kGeometry},
       .reads = {kProvenance, kCorrectedAb, kCorrectedProvenance},
       .leaves = {kModel},
       .results = {kModel},
       .resumes = true,
       .keeps_time_limit = true},
      {.kind = kind::kExport,
       .needs = {kScene, kModel},
       .reads = {kKeyView},
       .leaves = {kPly, kSog, kSpz, kGlb, kSplat, kSplat4d, kMoments, kViewPage, kExportScores},
       .results = {kPly, kSog, kSpz, kGlb, kSplat, kSplat4d, kMoments, kViewPage}},
      {.kind = kind::kRender,
       .needs = {kScene, kModel},
       // of films and what moves
       .reads = {kKeyView, kKeyColor, kViewsAb, kCorrectedAb, kImportFacts},
       .leaves = {kRenders, kMovie, kFilm, kFilms, kFilmFrames, kFrames},
       .results = {kRenders, kMovie, kFilm, kFilms, kFilmFrames}},
      {.kind = kind::kEvaluate,
       .needs = {kScene, kViewsAb, kModel},
       .reads = {kKeyView, kKeyColor, kProvenance, kCorrectedAb, kCorrectedProvenance},
       .leaves = {kScores, kTruths, kColored2d}},
      // Its report reads what all the others have left.
      {.kind = kind::kColorizeScene,
       .leaves = {kReport, kMetrics, kAllCurves, kPlan},
       .results = {kReport, kMetrics, kAllCurves, kPlan}},
      {.kind = kind::kPersonalizeScenes},
  };
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

const Stage* StageThatLeaves(std::string_view artifact) {
  for (const Stage& stage : StageCatalogue()) {
    for (const std::string_view made : stage.leaves) {
      const bool below = made.ends_with('/') && artifact.starts_with(made);
      if (artifact == made || below) return &stage;
    }
  }
  return nullptr;
}

}  // namespace color3d
