#include "core/catalogue/captures.h"

#include <algorithm>
#include <set>

#include "core/base/error.h"
#include "core/catalogue/kind_row.h"
#include "core/catalogue/pose_files.h"
#include "core/catalogue/scene_files.h"
#include "core/catalogue/stages.h"
#include "core/image/probe/probe.h"

namespace color3d {
namespace {

constexpr char kHasPoses[] =
    "the scene has poses, and is coloured for all times; leave the range out, or colour the film "
    "without poses";

// Stages without work for a kind.
struct IdleStage {
  CaptureKind kind;
  const char* stage;
  const char* reason;
};

constexpr char kNotReconstructed[] =
    "frames of a film without poses are coloured, not reconstructed";
constexpr char kPicturesOnly[] =
    "photos whose cameras were not found are coloured, not reconstructed";
constexpr IdleStage kIdleStages[] = {
    {CaptureKind::kPictures, kind::kReconstructGeometry, kPicturesOnly},
    {CaptureKind::kPictures, kind::kSolveChroma, kPicturesOnly},
    {CaptureKind::kPictures, kind::kExport, kPicturesOnly},
    {CaptureKind::kFilm, kind::kReconstructGeometry, kNotReconstructed},
    {CaptureKind::kFilm, kind::kSolveChroma, kNotReconstructed},
    {CaptureKind::kFilm, kind::kExport, kNotReconstructed}};

// Counts of a scene's files by what their names say.
struct FileCounts {
  int photos = 0, films = 0, splats = 0;
  std::set<std::string_view> frame_folders;  // frames/ itself is one
  bool has_transforms = false, has_transforms_json = false, has_poses_bounds = false;
  bool has_metadata = false, has_cameras = false;  // of Nerfies
};

FileCounts Count(const std::vector<std::string>& files) {
  FileCounts counts;
  for (const std::string& file : files) {
    if (IsAugmentFile(file)) continue;
    const bool is_picture = HasImageExtension(file);
    if (IsFrameFile(file) && is_picture) {
      counts.frame_folders.insert(std::string_view(file).substr(0, file.rfind('/')));
    }
    counts.photos += is_picture && !IsMaskFile(file) ? 1 : 0;
    counts.films += HasFilmExtension(file) && !IsMaskFile(file) ? 1 : 0;
    counts.splats += HasSplatExtension(file) ? 1 : 0;
    counts.has_transforms |= file.find('/') == std::string::npos && IsTransformsFile(file);
    counts.has_transforms_json |= file == kTransformsFile;
    counts.has_poses_bounds |= file == kPosesBoundsFile;
    counts.has_metadata |= file == "metadata.json";
    counts.has_cameras |= file.starts_with("camera/") && file.ends_with(".json");
  }
  return counts;
}

}  // namespace

const std::vector<CaptureLayoutInfo>& CaptureLayouts() {
  using Layout = CaptureLayout;
  using Views = ViewSource;
  using Poses = PoseSource;
  using Kind = CaptureKind;
  static const std::vector<CaptureLayoutInfo> layouts = {
      {Layout::kUnknown, "-", Views::kPhotos, Poses::kEstimated, Kind::kStatic, false},
      {Layout::kPhotos, "photos", Views::kPhotos, Poses::kEstimated, Kind::kStatic, false},
      {Layout::kColmap, "colmap", Views::kPhotos, Poses::kFile, Kind::kStatic, true},
      {Layout::kTransforms, "transforms", Views::kPhotos, Poses::kFile, Kind::kStatic, false},
      {Layout::kSplat, "splat", Views::kSplatRenders, Poses::kFile, Kind::kStatic, false},
      {Layout::kFilm, "film", Views::kFrames, Poses::kOnRequest, Kind::kFilm, true},
      {Layout::kNerfies, "nerfies", Views::kPhotos, Poses::kFile, Kind::kDynamic, false},
      {Layout::kPosesBounds, "poses_bounds", Views::kPhotos, Poses::kFile, Kind::kStatic, false},
      {Layout::kFilms, "films", Views::kFrames, Poses::kEstimated, Kind::kDynamic, true},
      {Layout::kPosedFilms, "posed_films", Views::kFrames, Poses::kFile, Kind::kDynamic, true}};
  return layouts;
}

const CaptureLayoutInfo& InfoOf(CaptureLayout layout) {
  for (const CaptureLayoutInfo& info : CaptureLayouts()) {
    if (info.layout == layout) return info;
  }
  throw Error(ErrorCode::kInternal, "there is no layout {}", static_cast<int>(layout));
}

CaptureLayout LayoutOfName(std::string_view name) {
  for (const CaptureLayoutInfo& info : CaptureLayouts()) {
    if (info.name == name) return info.layout;
  }
  return CaptureLayout::kUnknown;
}

CaptureLayout DetectCapture(const std::vector<std::string>& files) {
  const FileCounts counts = Count(files);
  if (!counts.frame_folders.empty()) {
    return counts.frame_folders.size() > 1 ? CaptureLayout::kFilms : CaptureLayout::kFilm;
  }
  if (counts.photos == 0 && counts.films > 1) {
    if (counts.has_transforms_json) return CaptureLayout::kTransforms;
    return counts.has_poses_bounds ? CaptureLayout::kPosesBounds : CaptureLayout::kFilms;
  }
  if (counts.photos == 0 && counts.films == 1) return CaptureLayout::kFilm;
  if (counts.photos == 0 && counts.splats > 0) return CaptureLayout::kSplat;
  if (!ColmapPlaces(files).empty()) return CaptureLayout::kColmap;
  if (counts.has_metadata && counts.has_cameras) return CaptureLayout::kNerfies;
  if (counts.has_transforms) return CaptureLayout::kTransforms;
  return counts.has_poses_bounds ? CaptureLayout::kPosesBounds : CaptureLayout::kPhotos;
}

const std::vector<CaptureKindInfo>& CaptureKinds() {
  static const std::vector<CaptureKindInfo> kinds = {
      {CaptureKind::kStatic, "static", false, true, "the scene is not a film; leave the range out"},
      {CaptureKind::kFilm, "film", false, false, ""},
      {CaptureKind::kDynamic, "dynamic", true, true, kHasPoses},
      {CaptureKind::kRelief, "relief", true, true, kHasPoses},
      {CaptureKind::kPictures,
       "pictures",
       false,
       false,
       "the scene is not a film; leave the range out"}};
  return kinds;
}

const CaptureKindInfo& InfoOf(CaptureKind kind) {
  return RowOfKind(CaptureKinds(), kind, "properties");
}

CaptureKind KindOfName(std::string_view name) {
  std::string known;
  for (const CaptureKindInfo& info : CaptureKinds()) {
    if (info.name == name) return info.kind;
    known += (known.empty() ? "" : ", ") + std::string(info.name);
  }
  throw InvalidArgument("there is no kind of scene '{}'; there are {}", name, known);
}

std::string_view WhyNothingToDo(CaptureKind kind, std::string_view stage) {
  for (const IdleStage& idle : kIdleStages) {
    if (idle.kind == kind && stage == idle.stage) return idle.reason;
  }
  return "";
}

}  // namespace color3d
