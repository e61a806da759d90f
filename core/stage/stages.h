// Every stage of the method: its options, and the function that runs it. What each reads and leaves
// is in core/catalogue/stages.cc. All throw Error and leave nothing half-written.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/carry/carry.h"
#include "core/carry/plane_sweep.h"
#include "core/carry/view_color.h"
#include "core/catalogue/stage_summary.h"
#include "core/colorizer/colorizer.h"
#include "core/film/film_carry.h"
#include "core/keycolor/hints/hints.h"
#include "core/keyview/select.h"
#include "core/scene/import.h"
#include "core/splat/chroma/chroma_options.h"
#include "core/splat/geometry/geometry_options.h"
#include "core/splat/import/splat_scene.h"
#include "core/stage/film/import_film.h"
#include "core/stage/stage.h"

namespace color3d {

// Throws Error{kInvalidArgument} unless a working size is 64..4096 px.
void CheckMaxSide(int max_side_px);

// The scene's files as views with poses; structure-from-motion where they have none. A scene of one
// splat (.ply, .sog, .spz) and no photos: views chosen around it and drawn in grey, and its
// Gaussians, which are the geometry. A film: its frames, without poses.
void RunImportScene(const ImportOptions& options,
                    StageContext& context,
                    const SplatViewOptions& splat_views = {},
                    const FilmOptions& film = {});

struct SelectKeyViewOptions {
  KeyViewOptions selection;
  std::string view;      // for KeyViewStrategy::kManual: name or unique file stem
  std::string encoder;   // weights by name in StageContext::Model; empty: the embedded encoder
  std::string features;  // CLIP weights by name; empty: the encoder's features
};
// The photo that the user should colour, or several. Only training views can win. Features of
// photos that were seen before come from the context's cache folder.
void RunSelectKeyView(const SelectKeyViewOptions& options, StageContext& context);

struct ColorizeKeyViewOptions {
  enum class Source {
    kImage,
    kStrokes,
    kPoints,
    kReferences,
    kPrompt,
    kAutomatic,
    kBackend,
    kScript,
    kEdit
  };
  Source source = Source::kImage;
  std::filesystem::path file;  // image, strokes, points (JSON), edit; backend: points, may be empty
  std::vector<std::filesystem::path> references;  // references: 1..16; backend: at most 1
  std::filesystem::path mask;                     // edit and backend; empty: everywhere
  std::filesystem::path labels;                   // points: the picture that labels refer to
  std::string prompt;                             // prompt; backend, may be empty
  std::string name;  // weights, script or backend by name; empty: the embedded model
  HintOptions hints;
  bool operator==(const ColorizeKeyViewOptions&) const = default;
};
// The key view in colour, and what its source tells of that.
void RunColorizeKeyView(const ColorizeKeyViewOptions& options, StageContext& context);

// A key view beside the first one. Of its colours only those are taken that the key views before it
// have not given already; so they never contradict. In a film it colours the frames of its shot
// that are nearer to it and what is open in others, and has what is not painted from the key views
// before it.
struct FurtherKeyView {
  std::string view;  // name or unique file stem
  ColorizeKeyViewOptions color;
  // Of a correction of a film: the frames of its shot that it counts in, seconds of the film, both
  // ends included; nothing: from the beginning, to the end.
  std::optional<double> begin_s = {};
  std::optional<double> end_s = {};
  bool HasRange() const { return begin_s || end_s; }
  bool operator==(const FurtherKeyView&) const = default;
};

struct CarryColorOptions {
  int max_side_px = 500;    // of the carried maps, 64..4096
  int depth_side_px = 300;  // at which depth is measured, 64..2048
  int depth_sources = 4;    // views that each view is compared with, 1..16
  PlaneSweepOptions sweep;
  CarryOptions carry;
  FilmCarryOptions film;                // of a film: by motion
  std::vector<FurtherKeyView> further;  // in the order of their importance, at most 16
  void Validate() const;
  bool operator==(const CarryColorOptions&) const = default;
};
// The key views' own colours in every view, as far as it shows the same, and how much that is.
void RunCarryColor(const CarryColorOptions& options, StageContext& context);

struct AugmentationOptions {
  bool files = false;  // the user's own, below augment/ of the scene's folder
  int samples = 8;     // 0..64, besides the user's own files; 8: the paper's 4 + 1 + 3
  bool outpaint = true;
  bool animate = true;
  bool novel_views = true;
  std::string backend;    // a generator by name; empty: the embedded surrogates
  int max_side_px = 400;  // of the pictures, 64..4096
  void Validate() const;
  bool operator==(const AugmentationOptions&) const = default;
};
// Training pictures beside the key view: the files below augment/ of the scene's folder if they are
// asked for, a generator's, and ours. Novel views need the geometry among the inputs.
void RunGenerateAugmentations(const AugmentationOptions& options, StageContext& context);

// The scene's colorizer, trained on the key view, what was carried and what was generated. Warns
// when the key view has no colour. `encoder`: as SelectKeyViewOptions.
void RunPersonalize(const ColorizerOptions& options,
                    StageContext& context,
                    const std::string& encoder = "");

// The colour of every view and where it comes from, at max_side_px (64..4096). `encoder`: the one
// that the colorizer was trained with.
void RunColorizeViews(int max_side_px, StageContext& context, const std::string& encoder = "");
// Whom it asks for colours: the scene's colorizer, which must outlive the answer, and the embedded
// automatic one. `position` gives PictureFacts' of the luminance; asked for with the colour.
ColorSources SourcesOf(const Colorizer& colorizer,
                       std::function<Image(const Image& luminance)> position = {});

struct CorrectColorsOptions {
  // Parts of photos in the colours that they should have, later ones over earlier ones, at most 64:
  // strokes, points or a picture (sources/given_colors.h). No held-out views. Of a film: key frames
  // with a range of time (recolor/time_ranges.h), from any source.
  std::vector<FurtherKeyView> corrections;
  int proposals = 3;  // how many further places are named, 0..16
  void Validate() const;
  bool operator==(const CorrectColorsOptions&) const = default;
};
// The colours of every view, corrected: where the user says so, and in whatever is like that and
// near it (METHOD.md "Corrections"). `encoder`: as RunColorizeViews'.
void RunCorrectColors(const CorrectColorsOptions& options,
                      StageContext& context,
                      const std::string& encoder = "");

// Gaussians of luminance, trained at max_side_px (64..4096). With little memory the size and the
// number of Gaussians are smaller, and a warning says so. Gaussians that came with the scene are
// handed on as they are.
void RunReconstructGeometry(const GeometryOptions& options, int max_side_px, StageContext& context);

// The views' chroma on the geometry, with confidence when every training view has its provenance.
void RunSolveChroma(const ChromaOptions& options, StageContext& context);

struct ExportOptions {
  bool ply = true;      // 3DGS with RGB spherical harmonics
  bool sog = true;      // the same in a tenth of the bytes, for web viewers
  bool spz = false;     // a byte or two for each number
  int spz_version = 4;  // 4, or 2 for older readers
  bool glb = false;     // glTF with KHR_gaussian_splatting
  bool splat = false;   // 32 bytes a Gaussian, no view dependence
  bool splat4d = true;  // of a scene that moves: all of its moments, for web players
  // PLY with a property "confidence", which strict viewers may refuse; needs a model that has it.
  bool confidence = false;
  // Of a scene that moves: PLYs of so many moments, evenly over its time, 0..1000.
  int moments = 0;
  void Validate() const;
  bool operator==(const ExportOptions&) const = default;
};
// The model for viewers in RGB, and what that loses against our renders. Of a scene that moves it
// is that of the key view's moment.
void RunExport(const ExportOptions& options, StageContext& context);

inline constexpr int kMaxMovieFrames = 18'000;   // ten minutes at 30 frames a second
inline constexpr int kMaxMoviePictures = 1'000;  // of them, where each is kept as a picture
inline constexpr int kDefaultMovieFrames = 240;

struct RenderOptions {
  // Pictures of views; or a movie: on the turn around the key view, through the photos' cameras in
  // the order of their names (of a scene that moves: frame by frame with the key view's camera), by
  // the cameras of a file, or where the key view's camera stood.
  enum class Path { kViews, kOrbit, kPhotos, kCameras, kStill };
  // By name. For kViews; empty: held-out views, or evenly spread ones. For kPhotos, in this order;
  // empty: all.
  std::vector<std::string> views;
  int max_views = 12;     // 1..1000, for the empty list
  int max_side_px = 500;  // 64..4096
  Path path = Path::kViews;
  // The rest is of movies, but for `pictures`. 1..kMaxMovieFrames; nothing: kDefaultMovieFrames, of
  // a file of cameras one for each, of a scene that moves with kPhotos and kStill one for each
  // moment.
  std::optional<int> frames;
  double frames_per_second = 30.0;  // 1..120
  bool video = true;                // kMovie is made
  // kFrames are kept, at most kMaxMoviePictures; with kViews, of a film and of what cameras filmed,
  // kFilmFrames.
  bool pictures = false;
  bool bounce = false;  // there and back again
  // Of a scene that moves: it stands still at this time, seconds; nothing: time runs.
  std::optional<double> time_s;
  std::filesystem::path cameras;  // for kCameras: scene/formats/camera_file.h
  void Validate() const;
  bool operator==(const RenderOptions&) const = default;
};
// Pictures of the model, or a movie.
void RunRender(const RenderOptions& options, StageContext& context);

struct TruthFile {
  std::string view;
  std::filesystem::path file;
};
struct EvaluateOptions {
  std::vector<TruthFile> truth;           // of held-out views: these are scored. May be empty
  std::vector<TruthFile> training_truth;  // of training views. May be empty
  // Also score what the same geometry reaches under the true colours of all training views
  // ("delta_e00_chroma_bound"): what the reconstruction itself costs. About as long as
  // solve_chroma.
  bool bound = false;
  ChromaOptions chroma;  // of the bound
  void Validate() const;
};
// Scores, with the pictures that were compared. Without any truth only the consistency between
// views (ME, TC) is scored.
void RunEvaluate(const EvaluateOptions& options, StageContext& context);

// The report on a coloured scene, its metrics, curves and plan; results of the other stages are
// passed on.
void RunReport(const std::vector<StageSummary>& stages, StageContext& context);

}  // namespace color3d
