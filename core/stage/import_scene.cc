#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "core/base/files.h"
#include "core/catalogue/captures.h"
#include "core/catalogue/scene_files.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/import/hold_out.h"
#include "core/splat/import/splat_scene.h"
#include "core/splat/raster/render.h"
#include "core/stage/film_import/film_frames.h"
#include "core/stage/film_import/import_camera_films.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/import_output.h"
#include "core/stage/run_stages.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Requires: the scene is laid out as a splat.
std::string FindSplat(const std::vector<std::string>& files) {
  const auto is_splat = [](const std::string& file) {
    return HasSplatExtension(file) && !IsAugmentFile(file) && !IsMaskFile(file);
  };
  const auto splat = std::ranges::find_if(files, is_splat);
  if (splat == files.end()) throw InvalidArgument("the scene holds no splat outside of masks/");
  return *splat;
}

// As a photo of the Gaussians would be, in grey.
std::string PhotoOf(const GaussianModel& model, const View& view, ThreadPool& pool) {
  Image gray = RenderView(model, view.camera, view.cam_from_world, pool).lab;
  for (float& v : gray.data) v = static_cast<float>(GrayFromLuminance(v));
  return EncodePng16(gray);
}

void ImportSplatScene(const std::string& file,
                      const ImportOptions& options,
                      const SplatViewOptions& views,
                      StageContext& context) {
  SplatScene splat = ImportSplat(ReadFile(context.scene_folder() / file),
                                 file,
                                 views,
                                 context.MemoryBytes(),
                                 context.control());
  Scene& scene = splat.scene;
  if (options.hold_out_every_eighth) HoldOutEveryEighth(&scene, &splat.warnings);
  if (options.hold_out_block > 0.0) HoldOutBlock(options.hold_out_block, &scene);
  for (const std::string& warning : splat.warnings) context.Warn(warning);
  const auto count = std::ssize(scene.views);
  for (int64_t i = 0; i < count; ++i) {
    context.ThrowIfCancelled();
    context.ReportProgress(i, count, "drawing views");
    View& view = scene.views[static_cast<size_t>(i)];
    view.image_file = artifact::kGivenViews + view.name;
    context.WriteOutput(view.image_file, PhotoOf(splat.geometry, view, context.pool()));
  }
  ImportFacts facts;
  facts.layout = CaptureLayout::kSplat;
  facts.photos_found = facts.photos_registered = static_cast<int>(count);
  context.WriteOutput(artifact::kGivenGeometry, SerializeGaussians(splat.geometry));
  context.WriteOutput(artifact::kScene, SceneToJson(scene));
  context.WriteOutput(artifact::kImportFacts, ImportFactsToJson(facts));
}

}  // namespace

void RunImportScene(const ImportOptions& options,
                    StageContext& context,
                    const SplatViewOptions& splat_views,
                    const FilmOptions& film_options) {
  options.Validate();
  splat_views.Validate();
  film_options.Validate();
  if (ImportCameraFilms(options, film_options, context)) return;
  std::error_code none;
  std::vector<std::string> files;
  if (fs::is_directory(context.scene_folder(), none)) files = ListFiles(context.scene_folder());
  const CaptureLayout layout = DetectCapture(files);
  if (layout == CaptureLayout::kFilm)
    return ImportFilm(FindFilm(files), film_options, options, context);
  if (layout == CaptureLayout::kSplat) {
    WarnOfUnusedOptions(film_options, ImportedAs::kPhotos, context);
    return ImportSplatScene(FindSplat(files), options, splat_views, context);
  }
  ImportOptions within = options;
  within.memory_bytes = context.MemoryBytes();
  const ImportResult result =
      ImportScene(context.scene_folder(), context.scratch_folder(), within, context.control());
  const ImportedAs what =
      result.scene.capture().is_dynamic ? ImportedAs::kTimedPictures : ImportedAs::kPhotos;
  WarnOfUnusedOptions(film_options, what, context);
  WriteImported(result, context);
}

}  // namespace color3d
