// The artifacts: files that stages hand to each other and to users, by their path below a job's
// results. A name that ends in "/" is a folder with one or more files for each view or picture. A
// new artifact is a name here, a row in artifacts.cc, and the stage that writes it; the stage that
// reads it names it in stages.cc. Constants and pure functions.
#pragma once

#include <string_view>
#include <vector>

namespace color3d {

namespace artifact {

inline constexpr char kScene[] = "scene.json";
inline constexpr char kImportFacts[] = "import.json";  // what the import decided and found
inline constexpr char kSfmLog[] = "sfm.log";
// Scenes that are a splat: the views that were rendered from it in place of photos, view's stem +
// ".png" (linked into the scene's folder for every stage that reads them), and its Gaussians in
// grey.
inline constexpr char kGivenViews[] = "given_views/";
inline constexpr char kGivenGeometry[] = "given.c3g";
// Films with poses: masks of the moving regions, view's stem + ".png", 480 px, white is moving.
inline constexpr char kMovingRegions[] = "moving/";
inline constexpr char kKeyView[] = "key_view.json";                // its name, and the reason
inline constexpr char kKeyViewGray[] = "key_view.png";             // as captured: to be coloured
inline constexpr char kKeyViewRanking[] = "key_view_ranking.jpg";  // contact sheet of candidates
inline constexpr char kKeyColor[] = "key_color.png";               // ab, undistorted: image/codec.h
inline constexpr char kKeyColorFacts[] = "key_color.json";         // the source of the colour
inline constexpr char kKeyColorRegions[] = "key_color_regions.jpg";  // regions of a prompt's words
inline constexpr char kKeyViewColored[] = "key_view_colored.png";    // for users
// Additional key views: a folder each, "1/" and so on in the order in which they were given, with
// the artifacts that colorize_key_view wrote for it.
inline constexpr char kKeyViews[] = "key_views/";
inline constexpr char kGeometry[] = "geometry.c3g";  // Gaussians with luminance only
inline constexpr char kMemoryPlan[] = "memory_plan.json";
// State of training at the end of the warm-up, if solve_chroma is to train the rest.
inline constexpr char kWarmUp[] = "warm_up.c3t";
inline constexpr char kCarried[] = "carried/";       // view's stem + ".png": ab and confidence
inline constexpr char kCarryFacts[] = "carry.json";  // coverage, the view to colour next
inline constexpr char kAugmentationFacts[] = "augmentations.json";  // samples made and left out
// name + ".png" (the picture), ".ab.png" (its colour) and ".weight.png"
inline constexpr char kAugmentations[] = "augmentations/";
inline constexpr char kAugmentationSheet[] = "augmentations.jpg";  // contact sheet
inline constexpr char kColorizer[] = "colorizer.c3c";
inline constexpr char kViewsAb[] = "views_ab/";  // view's stem + ".png"
// view's stem + ".png": 8-bit RGB, shares of guessed, seen and inferred colour (sum 255)
inline constexpr char kProvenance[] = "provenance/";
// The same after corrections; where they exist they replace the two above.
inline constexpr char kCorrectedAb[] = "corrected_ab/";
inline constexpr char kCorrectedProvenance[] = "corrected_provenance/";
// view's stem + ".png", at most 480 px: where the last correction acts, for a reach of 1
inline constexpr char kPull[] = "pull/";
inline constexpr char kCorrections[] = "corrections.json";  // reach of each, and proposed views
// view's stem + ".png": photos where a correction is proposed, in their present colours
inline constexpr char kPaint[] = "paint/";
inline constexpr char kModel[] = "model.c3g";                    // Gaussians in colour
inline constexpr char kJointTraining[] = "joint_training.json";  // its size and seconds, if it ran
// The other formats of export stand in export_formats.h alone.
inline constexpr char kPly[] = "scene.ply";
inline constexpr char kSog[] = "scene.sog";
inline constexpr char kSpz[] = "scene.spz";
inline constexpr char kMoments[] = "moments/";          // "00001.ply" and so on
inline constexpr char kViewPage[] = "view.html";        // viewer and scene in one file
inline constexpr char kExportScores[] = "export.json";  // difference from our own renders
inline constexpr char kRenders[] = "renders/";          // view's stem + ".png"
inline constexpr char kMovie[] = "scene.mp4";           // rendered along a path
// Films and dynamic scenes: the coloured film of the key view's camera; with several cameras, of
// each, by its name + ".mp4".
inline constexpr char kFilm[] = "film.mp4";
inline constexpr char kFilms[] = "films/";
// Scenes of pictures: view's stem + ".png", coloured, of its own size.
inline constexpr char kColoredPhotos[] = "photos/";
inline constexpr char kFilmFrames[] = "film_frames/";  // view's stem + ".png": its coloured frames
inline constexpr char kFrames[] = "frames/";           // "00001.png" and so on, of the movie
inline constexpr char kScores[] = "scores.json";
inline constexpr char kTruths[] = "truths/";            // view's stem + ".jpg"
inline constexpr char kColored2d[] = "colored_views/";  // view's stem + ".jpg"
inline constexpr char kReport[] = "report.html";
inline constexpr char kMetrics[] = "metrics.json";
inline constexpr char kAllCurves[] = "curves.csv";
inline constexpr char kPlan[] = "plan.json";
// Error curves of a stage: its kind + ".csv". Written by every stage that measures errors.
inline constexpr char kCurves[] = "curves/";

}  // namespace artifact

struct Artifact {
  const char* name;
  const char* stage;       // kind of the stage that writes it; nullptr: every stage
  const char* media_type;  // for a folder, of the files in it
  // Belongs to a coloured scene: the report publishes it again.
  bool is_result = false;
  const char* label = nullptr;  // in the client's list of results; nullptr: not listed
  bool IsFolder() const;
};

// In the order of the pipeline; within a stage, the artifact that it always writes comes first.
const std::vector<Artifact>& ArtifactCatalogue();

// The row of an artifact or of the folder that it lies in; nullptr if there is none.
const Artifact* FindArtifact(std::string_view name);

// "application/octet-stream" for an unknown artifact.
const char* MediaTypeOf(std::string_view name);

}  // namespace color3d
