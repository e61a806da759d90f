// Names of what stages hand to each other and to people: paths below a job's results. The only
// place where they are spelled; stages.cc says which stage makes and reads which. A name that ends
// in "/" is a folder with one or more files for each view or picture.
#pragma once

namespace color3d::artifact {

inline constexpr char kScene[] = "scene.json";
inline constexpr char kImportFacts[] = "import.json";  // what the import found out
inline constexpr char kSfmLog[] = "sfm.log";
// Of a scene that is a splat: what stands for photos, drawn from it (view's stem + ".png"; they lie
// in the scene's folder for all stages that are given them), and its Gaussians in grey.
inline constexpr char kGivenViews[] = "given_views/";
// Of a film with poses, view's stem + ".png", 480 px: white where something moves on its own.
inline constexpr char kMovingRegions[] = "moving/";
inline constexpr char kGivenGeometry[] = "given.c3g";
inline constexpr char kKeyView[] = "key_view.json";                // which view, and why
inline constexpr char kKeyViewGray[] = "key_view.png";             // as captured: to be coloured
inline constexpr char kKeyViewRanking[] = "key_view_ranking.jpg";  // contact sheet of candidates
inline constexpr char kKeyColor[] = "key_color.png";               // ab, undistorted: image/codec.h
inline constexpr char kKeyColorFacts[] = "key_color.json";         // where the colour came from
inline constexpr char kKeyColorRegions[] = "key_color_regions.jpg";  // which words went where
inline constexpr char kKeyViewColored[] = "key_view_colored.png";    // for people
// Additional key views: a folder each, "1/" and so on, in the order in which they were given, with
// the artifacts that colorize_key_view has made of it.
inline constexpr char kKeyViews[] = "key_views/";
inline constexpr char kGeometry[] = "geometry.c3g";  // Gaussians with luminance only
inline constexpr char kMemoryPlan[] = "memory_plan.json";
inline constexpr char kCarried[] = "carried/";       // view's stem + ".png": ab and confidence
inline constexpr char kCarryFacts[] = "carry.json";  // coverage, which view to colour next
inline constexpr char kAugmentationFacts[] = "augmentations.json";  // what was made, what not, why
// name + ".png" (the picture), ".ab.png" (its colour) and ".weight.png"
inline constexpr char kAugmentations[] = "augmentations/";
inline constexpr char kAugmentationSheet[] = "augmentations.jpg";  // contact sheet
inline constexpr char kColorizer[] = "colorizer.c3c";
inline constexpr char kViewsAb[] = "views_ab/";  // view's stem + ".png"
// view's stem + ".png": 8-bit RGB, shares of guessed, seen and inferred colour (sum 255)
inline constexpr char kProvenance[] = "provenance/";
// The same after corrections, where there are any; they stand for those above then.
inline constexpr char kCorrectedAb[] = "corrected_ab/";
inline constexpr char kCorrectedProvenance[] = "corrected_provenance/";
// How far corrections reached, and where the next ones would tell most.
inline constexpr char kCorrections[] = "corrections.json";
// view's stem + ".png": photos where a correction is proposed, in their present colours
inline constexpr char kPaint[] = "paint/";
inline constexpr char kModel[] = "model.c3g";  // Gaussians in colour
inline constexpr char kPly[] = "scene.ply";
inline constexpr char kSog[] = "scene.sog";
inline constexpr char kSpz[] = "scene.spz";
inline constexpr char kGlb[] = "scene.glb";
inline constexpr char kSplat[] = "scene.splat";
inline constexpr char kSplat4d[] = "scene.splat4d";  // of a scene that moves
inline constexpr char kMoments[] = "moments/";       // "00001.ply" and so on, of a scene that moves
inline constexpr char kExportScores[] = "export.json";  // what they lose against our renders
inline constexpr char kRenders[] = "renders/";          // view's stem + ".png"
inline constexpr char kMovie[] = "scene.mp4";
// Of a scene that moves: what the key view's camera filmed, in colour; and of several cameras each,
// by its name + ".mp4".
inline constexpr char kFilm[] = "film.mp4";
inline constexpr char kFilms[] = "films/";
inline constexpr char kFilmFrames[] =
    "film_frames/";                           // view's stem + ".png": its frames, in colour
inline constexpr char kFrames[] = "frames/";  // "00001.png" and so on, of the movie
inline constexpr char kScores[] = "scores.json";
inline constexpr char kTruths[] = "truths/";            // view's stem + ".jpg"
inline constexpr char kColored2d[] = "colored_views/";  // view's stem + ".jpg"
inline constexpr char kReport[] = "report.html";
inline constexpr char kViewPage[] = "view.html";  // the scene in a browser, all in one file
inline constexpr char kMetrics[] = "metrics.json";
inline constexpr char kAllCurves[] = "curves.csv";
inline constexpr char kPlan[] = "plan.json";
// Left by every stage that measures errors while it runs: the stage's kind + ".csv".
inline constexpr char kCurves[] = "curves/";

}  // namespace color3d::artifact
