// Captures: how the files of a scene are laid out, and what kind of scene import makes of them. All
// layouts and kinds are listed here; the server and import detect a layout by the same function.
// Thread-safe.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace color3d {

// The values are those of the API's Scene.Layout, and are kept in stores.
enum class CaptureLayout {
  kUnknown = 0,
  kPhotos = 1,       // photos without poses
  kColmap = 2,       // photos with COLMAP models
  kTransforms = 3,   // photos, or films of several cameras, with a transforms.json
  kSplat = 4,        // one splat
  kFilm = 5,         // one film: a video file, or pictures in frames/
  kNerfies = 6,      // photos with the cameras of Nerfies or HyperNeRF
  kPosesBounds = 7,  // films of several cameras, or photos, with a poses_bounds.npy
  kFilms = 8,        // films of several cameras without poses
  // Found by import alone: films of several cameras with poses in a file.
  kPosedFilms = 9,
};

// Kind of scene that import makes of a capture.
enum class CaptureKind {
  kStatic,    // posed views of a place, without times
  kFilm,      // frames of one camera without poses: coloured, not reconstructed
  kDynamic,   // posed views with times
  kRelief,    // frames of one standing camera with assumed depth (2.5D)
  kPictures,  // photos whose cameras could not be found: coloured, not reconstructed
};

enum class ViewSource { kPhotos, kFrames, kSplatRenders };

enum class PoseSource {
  kFile,       // the capture holds them
  kEstimated,  // by import
  kOnRequest,  // estimated if import_scene.film_poses asks for it
};

struct CaptureLayoutInfo {
  CaptureLayout layout;
  const char* name;  // in import.json and on the command line
  ViewSource views;
  PoseSource poses;
  CaptureKind kind;        // as far as it is known before import, without poses on request
  bool times_are_seconds;  // times of its frames; else they may be shares of the whole
};

const std::vector<CaptureLayoutInfo>& CaptureLayouts();

// Throws Error{kInternal} for a value without a row.
const CaptureLayoutInfo& InfoOf(CaptureLayout layout);

// kUnknown where no layout has that name.
CaptureLayout LayoutOfName(std::string_view name);

// The layout of a scene's files, which are paths relative to its folder with '/' separators. By
// names alone: frames/ before photos, photos before films, films before splats. kPhotos where
// nothing else fits.
CaptureLayout DetectCapture(const std::vector<std::string>& files);

struct CaptureKindInfo {
  CaptureKind kind;
  const char* name;       // in scene.json
  bool is_dynamic;        // posed views with times: what is reconstructed may move
  bool is_reconstructed;  // Gaussians are made of it
  // Why no range of time can be recoloured, with the remedy; "" if it can be.
  const char* why_no_time_range;
};

const std::vector<CaptureKindInfo>& CaptureKinds();
const CaptureKindInfo& InfoOf(CaptureKind kind);
// Throws Error{kInvalidArgument} naming the kinds that there are.
CaptureKind KindOfName(std::string_view name);

// Reason why a stage (core/catalogue/stages.h) has nothing to do for a kind; empty where it has.
std::string_view WhyNothingToDo(CaptureKind kind, std::string_view stage);

}  // namespace color3d
