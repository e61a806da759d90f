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

void AddExportFormats(std::vector<Artifact>* artifacts) {
  for (const ExportFormatInfo& format : kExportFormats) {
    artifacts->push_back({.name = format.artifact,
                          .stage = kind::kExport,
                          .media_type = format.media_type,
                          .is_result = true,
                          .label = format.label});
  }
}

std::vector<Artifact> MakeCatalogue() {
  using namespace artifact;
  std::vector<Artifact> artifacts = {
      {kScene, kind::kImportScene, kJson},
      {kImportFacts, kind::kImportScene, kJson},
      {kSfmLog, kind::kImportScene, kText, true},
      {kGivenViews, kind::kImportScene, kPng},
      {kMovingRegions, kind::kImportScene, kPng},
      {kGivenGeometry, kind::kImportScene, kBinary},
      {kKeyView, kind::kSelectKeyView, kJson, true},
      {kKeyViewGray, kind::kSelectKeyView, kPng, true},
      {kKeyViewRanking, kind::kSelectKeyView, kJpeg, true},
      {kKeyColor, kind::kColorizeKeyView, kPng},
      {kKeyColorFacts, kind::kColorizeKeyView, kJson, true},
      {kKeyColorRegions, kind::kColorizeKeyView, kJpeg, true},
      {kKeyViewColored, kind::kColorizeKeyView, kPng, true},
      {kKeyViews, kind::kColorizeKeyView, kBinary, true},  // each file as above
      {kGeometry, kind::kReconstructGeometry, kBinary},
      {kMemoryPlan, kind::kReconstructGeometry, kJson},
      {kCarried, kind::kCarryColor, kPng},
      {kCarryFacts, kind::kCarryColor, kJson},
      {kAugmentationFacts, kind::kGenerateAugmentations, kJson},
      {kAugmentations, kind::kGenerateAugmentations, kPng},
      {kAugmentationSheet, kind::kGenerateAugmentations, kJpeg, true},
      {kColorizer, kind::kPersonalize, kBinary, true},
      {kViewsAb, kind::kColorizeViews, kPng},
      {kProvenance, kind::kColorizeViews, kPng},
      {kCorrectedAb, kind::kCorrectColors, kPng},
      {kCorrectedProvenance, kind::kCorrectColors, kPng},
      {kCorrections, kind::kCorrectColors, kJson, true},
      {kPaint, kind::kCorrectColors, kPng, true},
      {kModel, kind::kSolveChroma, kBinary, true}};
  AddExportFormats(&artifacts);
  const std::vector<Artifact> others = {{kViewPage, kind::kExport, kHtml, true, "in the browser"},
                                        {kExportScores, kind::kExport, kJson},
                                        {kRenders, kind::kRender, kPng, true},
                                        {kFilm, kind::kRender, kMp4, true, "coloured film"},
                                        {kFilms, kind::kRender, kMp4, true, "film of every camera"},
                                        {kFilmFrames, kind::kRender, kPng, true, "coloured frames"},
                                        {kMovie, kind::kRender, kMp4, true, "rendered movie"},
                                        {kFrames, kind::kRender, kPng},
                                        {kScores, kind::kEvaluate, kJson},
                                        {kTruths, kind::kEvaluate, kJpeg},
                                        {kColored2d, kind::kEvaluate, kJpeg},
                                        {kReport, kind::kColorizeScene, kHtml, true, "report"},
                                        {kMetrics, kind::kColorizeScene, kJson, true},
                                        {kAllCurves, kind::kColorizeScene, kCsv, true},
                                        {kPlan, kind::kColorizeScene, kJson, true},
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
