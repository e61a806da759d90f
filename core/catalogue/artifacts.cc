#include "core/catalogue/artifacts.h"

#include "core/catalogue/export_formats.h"
#include "core/catalogue/stages.h"

namespace color3d {
namespace {

constexpr char kBinary[] = "application/octet-stream";
constexpr char kCsv[] = "text/csv";
constexpr char kHtml[] = "text/html";
constexpr char kJpeg[] = "image/jpeg";
constexpr char kJson[] = "application/json";
constexpr char kMp4[] = "video/mp4";
constexpr char kPng[] = "image/png";
constexpr char kText[] = "text/plain";

std::vector<Artifact> MakeCatalogue() {
  using namespace artifact;
  using namespace kind;
  std::vector<Artifact> artifacts = {
      {kScene, kImportScene, kJson},
      {kImportFacts, kImportScene, kJson},
      {kSfmLog, kImportScene, kText, true},
      {kGivenViews, kImportScene, kPng},
      {kMovingRegions, kImportScene, kPng},
      {kGivenGeometry, kImportScene, kBinary},
      {kKeyView, kSelectKeyView, kJson, true},
      {kKeyViewGray, kSelectKeyView, kPng, true},
      {kKeyViewRanking, kSelectKeyView, kJpeg, true},
      {kKeyColor, kColorizeKeyView, kPng},
      {kKeyColorFacts, kColorizeKeyView, kJson, true},
      {kKeyColorRegions, kColorizeKeyView, kJpeg, true},
      {kKeyViewColored, kColorizeKeyView, kPng, true},
      {kKeyViews, kColorizeKeyView, kBinary, true},  // each file as above
      {kGeometry, kReconstructGeometry, kBinary},
      {kMemoryPlan, kReconstructGeometry, kJson},
      {kWarmUp, kReconstructGeometry, kBinary},
      {kCarried, kCarryColor, kPng},
      {kCarryFacts, kCarryColor, kJson},
      {kAugmentationFacts, kGenerateAugmentations, kJson},
      {kAugmentations, kGenerateAugmentations, kPng},
      {kAugmentationSheet, kGenerateAugmentations, kJpeg, true},
      {kColorizer, kPersonalize, kBinary, true},
      {kViewsAb, kColorizeViews, kPng},
      {kProvenance, kColorizeViews, kPng},
      {kCorrectedAb, kCorrectColors, kPng},
      {kCorrectedProvenance, kCorrectColors, kPng},
      {kPull, kCorrectColors, kPng},
      {kCorrections, kCorrectColors, kJson, true},
      {kPaint, kCorrectColors, kPng, true},
      {kModel, kSolveChroma, kBinary, true},
      {kJointTraining, kSolveChroma, kJson, true}};
  for (const ExportFormatInfo& format : kExportFormats) {
    artifacts.push_back({format.artifact, kExport, format.media_type, true, format.label});
  }
  const std::vector<Artifact> others = {{kViewPage, kExport, kHtml, true, "in the browser"},
                                        {kExportScores, kExport, kJson},
                                        {kRenders, kRender, kPng, true},
                                        {kFilm, kRender, kMp4, true, "coloured film"},
                                        {kFilms, kRender, kMp4, true, "film of every camera"},
                                        {kColoredPhotos, kRender, kPng, true, "coloured photos"},
                                        {kFilmFrames, kRender, kPng, true, "coloured frames"},
                                        {kMovie, kRender, kMp4, true, "rendered movie"},
                                        {kFrames, kRender, kPng},
                                        {kScores, kEvaluate, kJson, true},
                                        {kTruths, kEvaluate, kJpeg},
                                        {kColored2d, kEvaluate, kJpeg},
                                        {kReport, kColorizeScene, kHtml, true, "report"},
                                        {kMetrics, kColorizeScene, kJson, true},
                                        {kAllCurves, kColorizeScene, kCsv, true},
                                        {kPlan, kColorizeScene, kJson, true},
                                        {kCurves, nullptr, kCsv}};
  artifacts.insert(artifacts.end(), others.begin(), others.end());
  return artifacts;
}

}  // namespace

bool Artifact::IsFolder() const { return std::string_view(name).ends_with('/'); }

const std::vector<Artifact>& ArtifactCatalogue() {
  static const std::vector<Artifact> catalogue = MakeCatalogue();
  return catalogue;
}

const Artifact* FindArtifact(std::string_view name) {
  for (const Artifact& artifact : ArtifactCatalogue()) {
    if (name == artifact.name || (artifact.IsFolder() && name.starts_with(artifact.name))) {
      return &artifact;
    }
  }
  return nullptr;
}

const char* MediaTypeOf(std::string_view name) {
  const Artifact* artifact = FindArtifact(name);
  return artifact != nullptr ? artifact->media_type : kBinary;
}

}  // namespace color3d
