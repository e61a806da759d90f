// Names and formats of what stages hand to each other. The only place where they are spelled.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/image.h"
#include "core/carry/carry.h"
#include "core/scene/scene.h"

namespace color3d {

class StageContext;

namespace artifact {
inline constexpr char kScene[] = "scene.json";
inline constexpr char kImportFacts[] = "import.json";
inline constexpr char kSfmLog[] = "sfm.log";
inline constexpr char kKeyView[] = "key_view.json";
inline constexpr char kKeyViewGray[] = "key_view.png";               // as captured, grey: to colour
inline constexpr char kKeyViewRanking[] = "key_view_ranking.jpg";    // contact sheet
inline constexpr char kKeyColor[] = "key_color.png";                 // ab, undistorted, see codec.h
inline constexpr char kKeyColorFacts[] = "key_color.json";           // where the colour came from
inline constexpr char kKeyColorRegions[] = "key_color_regions.jpg";  // which words went where
inline constexpr char kKeyViewColored[] = "key_view_coloured.png";   // for people
inline constexpr char kAugmentationFacts[] = "augmentations.json";   // what was made, what not, why
// + name + ".png" (for people, and L), ".ab.png" and ".weight.png"
inline constexpr char kAugmentations[] = "augmentations/";
inline constexpr char kAugmentationSheet[] = "augmentations.jpg";  // contact sheet
inline constexpr char kColorizer[] = "colorizer.c3c";
inline constexpr char kCarried[] = "carried/";   // + view's stem + ".png": ab and confidence
inline constexpr char kViewsAb[] = "views_ab/";  // + view's stem + ".png"
// + view's stem + ".png": 8-bit RGB, shares of guessed, seen and inferred colour (sum 255).
inline constexpr char kProvenance[] = "provenance/";
inline constexpr char kCarryFacts[] = "carry.json";  // coverage, which view to colour next
inline constexpr char kGeometry[] = "geometry.c3g";
inline constexpr char kMemoryPlan[] = "memory_plan.json";
inline constexpr char kModel[] = "model.c3g";
inline constexpr char kPly[] = "scene.ply";
inline constexpr char kSplat[] = "scene.splat";
inline constexpr char kExportScores[] = "export.json";   // loss of the PLY against our own renders
inline constexpr char kRenders[] = "renders/";           // + view's stem + ".png"
inline constexpr char kTruths[] = "truths/";             // + view's stem + ".jpg"
inline constexpr char kColored2d[] = "coloured_views/";  // + view's stem + ".jpg"
inline constexpr char kScores[] = "scores.json";
inline constexpr char kCurves[] = "curves/";  // + stage + ".csv"
inline constexpr char kMetrics[] = "metrics.json";
inline constexpr char kAllCurves[] = "curves.csv";
inline constexpr char kPlan[] = "plan.json";
inline constexpr char kReport[] = "report.html";
}  // namespace artifact

// Job kind that makes an artifact, for error messages; "another" when the name is unknown.
std::string StageThatMakes(std::string_view artifact_name);

// "views_ab/0001.png" for the view "0001.jpg", and so on. The import stage sees to it that stems
// are unique (CheckStemsAreUnique).
std::string ViewArtifact(std::string_view folder, const View& view, std::string_view extension);

// Throws Error{kInvalidArgument} naming two photos that differ only in their file name extension:
// the results of one would overwrite those of the other.
void CheckStemsAreUnique(const Scene& scene);

// What the import stage found out, for the plan and the report.
struct ImportFacts {
  std::string layout;  // "photos", "colmap", "transforms"
  bool ran_structure_from_motion = false;
  std::string sfm_plan;  // which pairs were matched and why; empty when it did not run
  bool undistorted = false;
  bool random_points = false;
  int photos_found = 0;
  int photos_registered = 0;
};
std::string ImportFactsToJson(const ImportFacts& facts);
ImportFacts ImportFactsFromJson(std::string_view json);

// The chosen key view by name, with its index in the scene.
int ReadKeyView(const StageContext& context, const Scene& scene);
Scene ReadScene(const StageContext& context);

// What was carried into a view, resized; nothing where there is no such artifact.
CarriedColor ReadCarried(const StageContext& context, const View& view, int width, int height);

// Colour map of one view from its artifact, resized to width x height px.
Image ReadViewAb(const StageContext& context, const View& view, int width, int height);

// How sure that colour is, from its provenance: 1 channel, seen + inferred / 2, 0..1, resized to
// width x height px. Empty when the view has no provenance.
Image ReadViewConfidence(const StageContext& context, const View& view, int width, int height);

}  // namespace color3d
