// Formats of what stages hand to each other; the names are in core/catalogue/artifacts.h.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/image.h"
#include "core/carry/carry.h"
#include "core/catalogue/artifacts.h"
#include "core/scene/scene.h"

namespace color3d {

class StageContext;

// "views_ab/0001.png" for the view "0001.jpg", and so on. The import stage sees to it that stems
// are unique (CheckStemsAreUnique).
std::string ViewArtifact(std::string_view folder, const View& view, std::string_view extension);

// Throws Error{kInvalidArgument} naming two photos that differ only in their file name extension:
// the results of one would overwrite those of the other.
void CheckStemsAreUnique(const Scene& scene);

// Of a film whose frames' poses were looked for.
struct FilmFindings {
  bool poses_found = false;  // the scene is a dynamic one
  int frames_placed = 0;     // by structure-from-motion, also where they were too few
  bool camera_stands_still = false;
  double background_px = 0.0;  // median shift between frames of what the camera alone moves
  // With poses: median change of the camera's step from frame to frame, in steps; a camera that is
  // carried has about 0.1. Above 0.4 a warning is given.
  double path_unevenness = 0.0;
  double motion_energy = -1.0;  // share of the picture that moves on its own, 0..1; < 0: not known
};

struct FilmingCamera {
  std::string name;  // as the files tell it, else its folder or its film's name
  std::string film;  // relative to the scene's folder; empty: its frames came as pictures
};

// What the import stage found out, for the plan and the report.
struct ImportFacts {
  // "photos", "colmap", "transforms", "nerfies", "posed_films", "films", "splat", "film"
  std::string layout;
  bool ran_structure_from_motion = false;
  std::string sfm_plan;  // which pairs were matched and why; empty when it did not run
  bool undistorted = false;
  bool random_points = false;
  int photos_found = 0;
  int photos_registered = 0;
  int masked_views = 0;  // of which parts are masked out
  std::optional<FilmFindings> film;
  std::vector<FilmingCamera> cameras;  // by Moment::shot, of a scene that several filmed
};
std::string ImportFactsToJson(const ImportFacts& facts);
ImportFacts ImportFactsFromJson(std::string_view json);

Scene ReadScene(const StageContext& context);
// A film, or a dynamic scene of which nothing is reconstructed (neither kGeometry nor kModel is
// among the inputs): its frames are coloured one by one, by motion.
bool IsColoredAsFilm(const StageContext& context, const Scene& scene);
// Index of the chosen key view in the scene.
int ReadKeyView(const StageContext& context, const Scene& scene);
// Throws Error{kInvalidArgument} with the artifact's name when it is no JSON.
nlohmann::ordered_json ReadJson(const StageContext& context, const std::string& name);

// The key view's colour, resized; confidence 0 where the user left it unpainted.
CarriedColor ReadKeyColor(const StageContext& context, int width, int height);

// What was carried into a view, resized; nothing where there is no such artifact.
CarriedColor ReadCarried(const StageContext& context, const View& view, int width, int height);

// Longer side at which a view was coloured, px.
int ColoredSide(const StageContext& context, const View& view);

// The artifacts of a view that hold its colour and where that comes from: the corrected ones where
// there are any.
std::string ViewAbArtifact(const StageContext& context, const View& view);
std::string ProvenanceArtifact(const StageContext& context, const View& view);

// Colour map of one view, resized to width x height px.
Image ReadViewAb(const StageContext& context, const View& view, int width, int height);

// What the chroma solve goes by: the same, but the key view has the user's own colours as far as
// they were painted, unless they were corrected.
Image ReadTargetAb(
    const StageContext& context, const View& view, bool is_key, int width, int height);

// Where that colour comes from: 3 channels, shares of guessed, seen and inferred, resized to width
// x height px. Empty when the view has no provenance.
Image ReadProvenance(const StageContext& context, const View& view, int width, int height);

// How sure that colour is, from its provenance: 1 channel, seen + inferred / 2, 0..1, resized to
// width x height px. Empty when the view has no provenance.
Image ReadViewConfidence(const StageContext& context, const View& view, int width, int height);

}  // namespace color3d
