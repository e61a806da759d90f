// `splat-views`: how a splat becomes a scene. What is lost in grey, and whether the chosen views are
// like those that it was made from.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "core/base/cancellation.h"
#include "core/base/files.h"
#include "core/base/memory.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/splat/import/seen_gaussians.h"
#include "core/splat/import/splat_scene.h"
#include "core/splat/raster/render.h"
#include "tests/bench/commands.h"
#include "tests/bench/result_file.h"
#include "tests/support/formats/viewer_files.h"
#include "tests/support/quiet_run.h"

namespace color3d {
namespace {

constexpr int kSheetColumns = 6, kThumbnailPx = 240;

struct SplatViewArguments {
  std::string splat_file, scene_file, folder, json_file;
  SplatViewOptions options;
};

Image Gray(const Image& luminance) {
  Image gray = luminance;
  for (float& v : gray.data) v = static_cast<float>(GrayFromLuminance(v));
  return gray;
}

// Thumbnails side by side.
Image Sheet(const std::vector<Image>& pictures) {
  const int rows = (static_cast<int>(pictures.size()) + kSheetColumns - 1) / kSheetColumns;
  const Image first = FitWithin(pictures.at(0), kThumbnailPx);
  Image sheet(kSheetColumns * first.width, rows * first.height, 1);
  for (size_t i = 0; i < pictures.size(); ++i) {
    const Image small = FitWithin(pictures[i], kThumbnailPx);
    const int left = static_cast<int>(i) % kSheetColumns * first.width;
    const int top = static_cast<int>(i) / kSheetColumns * first.height;
    for (int y = 0; y < small.height; ++y) {
      for (int x = 0; x < small.width; ++x) {
        sheet.At(0, top + y, left + x) = small.At(0, y, x);
      }
    }
  }
  return sheet;
}

// Against the cameras of the photos that the splat was trained on.
nlohmann::ordered_json CompareWithCapture(const SplatScene& splat,
                                          const Scene& capture,
                                          ThreadPool& pool) {
  const Scene& scene = splat.scene;
  SeenGaussians seen(splat.geometry, scene.views.at(0).camera, pool);
  Eigen::Vector3d up = Eigen::Vector3d::Zero(), chosen_up = Eigen::Vector3d::Zero();
  double captured = 0.0, chosen = 0.0;
  std::vector<Eigen::Vector3d> forward;
  for (const View& view : capture.views) {
    Pose pose = view.cam_from_world;
    const Eigen::Vector3d center =
        (capture.WorldFromScene(pose.Center()) - scene.world_offset) / scene.world_from_scene_scale;
    pose.translation = -(pose.rotation * center);
    const SeenGaussians::Measure measure = seen.At(pose, 1e-9);
    captured += measure.seen / static_cast<double>(capture.views.size());
    up += pose.rotation.conjugate() * -Eigen::Vector3d::UnitY();
    forward.push_back(pose.rotation.conjugate() * Eigen::Vector3d::UnitZ());
  }
  double farthest = 0.0, mean = 0.0;
  for (const View& view : scene.views) {
    chosen += seen.At(view.cam_from_world, 1e-9).seen / static_cast<double>(scene.views.size());
    chosen_up += view.cam_from_world.rotation.conjugate() * -Eigen::Vector3d::UnitY();
    const Eigen::Vector3d mine = view.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
    double nearest = 4.0;
    for (const Eigen::Vector3d& other : forward) {
      nearest = std::min(nearest, std::acos(std::clamp(mine.dot(other), -1.0, 1.0)));
    }
    farthest = std::max(farthest, nearest);
    mean += nearest / static_cast<double>(scene.views.size());
  }
  constexpr double kDegrees = 57.29577951308232;
  const double tilt = std::acos(std::clamp(up.normalized().dot(chosen_up.normalized()), -1.0, 1.0));
  return {{"seen_by_chosen_over_captured", chosen / captured},
          {"up_error_degrees", kDegrees * tilt},
          {"mean_degrees_from_a_captured_direction", kDegrees * mean},
          {"most_degrees_from_a_captured_direction", kDegrees * farthest}};
}

void RunSplatViews(const SplatViewArguments& args) {
  ThreadPool pool;
  QuietRun run(pool);
  const std::string bytes = ReadFile(args.splat_file);
  ResetPeakMemory();
  const auto start = std::chrono::steady_clock::now();
  const SplatScene splat = ImportSplat(
      bytes, args.splat_file, args.options, AvailableMemoryBytes() / 10 * 6, run.control());
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  nlohmann::ordered_json report = {{"gaussians", splat.gaussians},
                                   {"dropped", splat.dropped},
                                   {"had_color", splat.had_color},
                                   {"sh_degree", splat.geometry.sh_degree},
                                   {"seconds", seconds.count()},
                                   {"peak_mib", PeakMemoryBytes() >> 20},
                                   {"views", splat.scene.views.size()},
                                   {"points", splat.scene.points.size()}};
  const ViewerGaussians original = ReadSplat(bytes);
  std::vector<Image> pictures;
  double psnr = 0.0;
  for (const View& view : splat.scene.views) {
    const RenderedView ours = RenderView(splat.geometry, view.camera, view.cam_from_world, pool);
    pictures.push_back(Gray(ours.lab));
    if (splat.dropped == 0 && splat.scene.world_from_scene_scale == 1.0) {
      const Image theirs = RenderForViewers(original, view.camera, view.cam_from_world, pool);
      psnr += PsnrOf(pictures.back(), Gray(LuminanceFromSrgb(theirs)));
    }
  }
  report["gray_psnr_db"] = psnr / static_cast<double>(pictures.size());
  if (!args.scene_file.empty()) {
    report["capture"] = CompareWithCapture(splat, SceneFromJson(ReadFile(args.scene_file)), pool);
  }
  if (!args.folder.empty()) {
    const std::filesystem::path folder = args.folder;
    std::filesystem::create_directories(folder);
    for (size_t i = 0; i < pictures.size(); ++i) {
      WriteFileAtomic(folder / splat.scene.views[i].name, EncodePng8(pictures[i]));
    }
    WriteFileAtomic(folder / "sheet.jpg", EncodeJpeg(Sheet(pictures)));
  }
  WriteResult(report, args.json_file);
}

}  // namespace

void AddSplatViewsCommand(CLI::App& app) {
  auto args = std::make_shared<SplatViewArguments>();
  CLI::App* command = app.add_subcommand(
      "splat-views", "a splat as a scene: the views that are chosen, and what is lost in grey");
  command->add_option("--splat", args->splat_file, "PLY, SOG or SPZ")->required();
  command->add_option("--scene", args->scene_file, "scene.json of the photos it was made from");
  command->add_option("--views", args->options.views)->capture_default_str();
  command->add_option("--side", args->options.side_px)->capture_default_str();
  command->add_option("--out", args->folder, "where the views go; default: nowhere");
  command->add_option("--json", args->json_file, "default: standard output");
  command->callback([args] { RunSplatViews(*args); });
}

}  // namespace color3d
