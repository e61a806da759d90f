// Formats of the artifacts that stages exchange. Their names are in core/catalogue/artifacts.h.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/image.h"
#include "core/carry/carry.h"
#include "core/catalogue/artifacts.h"
#include "core/catalogue/captures.h"
#include "core/image/codec.h"
#include "core/scene/scene.h"

namespace color3d {

class StageContext;

// E.g. "views_ab/0001.png" for the view "0001.jpg". Requires: stems are unique, which the import
// checks (CheckStemsAreUnique).
std::string ViewArtifact(std::string_view folder,
                         const View& view,
                         std::string_view extension = ".png");

// Throws Error{kInvalidArgument} with the names of two photos that differ in their extension only,
// because their results would overwrite each other.
void CheckStemsAreUnique(const Scene& scene);

// Findings of the search for the poses of a film.
struct FilmFindings {
  bool poses_found = false;  // the scene is dynamic
  int frames_placed = 0;     // by structure-from-motion, even if too few
  bool camera_stands_still = false;
  double background_px = 0.0;  // median shift of the background between frames
  // With poses: median change of the step of the camera from frame to frame, in steps. About 0.1
  // for a carried camera; a warning is given above 0.4.
  double path_unevenness = 0.0;
  double motion_energy = -1.0;  // share of the picture that is moving objects, 0..1; < 0: unknown
};

struct FilmingCamera {
  std::string name;  // from the files, else the name of its folder or film
  std::string film;  // relative to the folder of the scene; empty: frames came as pictures
};

// Findings of the import, for the plan and the report.
struct ImportFacts {
  CaptureLayout layout = CaptureLayout::kUnknown;
  bool ran_structure_from_motion = false;
  std::string sfm_plan;  // matched pairs, with the reason; empty if it did not run
  bool undistorted = false;
  bool random_points = false;
  int photos_found = 0;
  int photos_registered = 0;
  int masked_views = 0;  // views with masked parts
  std::optional<FilmFindings> film;
  std::vector<FilmingCamera> cameras;  // by Moment::shot; empty for a single camera
};
std::string ImportFactsToJson(const ImportFacts& facts);
ImportFacts ImportFactsFromJson(std::string_view json);

Scene ReadScene(const StageContext& context);
// Kind that the views of the scene are coloured as: its own; kFilm, frame by frame along optical
// flow, for a dynamic scene without geometry (neither kGeometry nor kModel among the inputs).
const CaptureKindInfo& ColoredAs(const StageContext& context, const Scene& scene);
// Index of the chosen key view in the scene.
int ReadKeyView(const StageContext& context, const Scene& scene);
// Throws Error{kInvalidArgument} with the name of the artifact if it is not JSON.
nlohmann::ordered_json ReadJson(const StageContext& context, const std::string& name);

// Picture among the inputs; ab and confidence. Throws Error{kInvalidArgument} if it is damaged.
Image ReadPicture(const StageContext& context, const std::string& name);
AbMap ReadAbMap(const StageContext& context, const std::string& name);

// The colour of the key view, resized. Confidence is 0 where it is not painted.
CarriedColor ReadKeyColor(const StageContext& context, int width, int height);

// The colour carried into a view, resized; empty if there is no such artifact.
CarriedColor ReadCarried(const StageContext& context, const View& view, int width, int height);

// Longer side of the coloured view, px.
int ColoredSide(const StageContext& context, const View& view);

// Names of the artifacts with the colour of a view and its provenance: the corrected ones if there
// are any.
std::string ViewAbArtifact(const StageContext& context, const View& view);
std::string ProvenanceArtifact(const StageContext& context, const View& view);

// Colour of a view, resized to width x height px.
Image ReadViewAb(const StageContext& context, const View& view, int width, int height);

// The target of the chroma solve: the colour of the view, but for the key view its given colour
// where it is painted and not corrected.
Image ReadTargetAb(
    const StageContext& context, const View& view, bool is_key, int width, int height);

// Provenance of the colour: 3 channels, shares of guessed, seen and inferred colour, resized to
// width x height px. Empty if the view has none.
Image ReadProvenance(const StageContext& context, const View& view, int width, int height);

// Shown confidence of the colour, from its provenance: 1 channel, seen + inferred / 2, 0..1,
// resized to width x height px. Empty if the view has no provenance.
Image ReadViewConfidence(const StageContext& context, const View& view, int width, int height);

}  // namespace color3d
