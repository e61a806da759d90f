// color3d-bench splat-views: loss of a splat in grey, and similarity of the chosen views to those
// that the splat was trained on.
#include <Eigen/Eigenvalues>
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
#include "core/color/difference.h"
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
  std::string splat_file, scene_file, colored_file, folder, json_file;
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

// Mean difference over the pixels of renders with equal luminance, i.e. of chroma alone.
double MeanDifference(const Image& truth, const Image& chroma) {
  Image lab = LabFromSrgb(truth);
  const Image other = LabFromSrgb(chroma);
  double sum = 0.0;
  for (size_t i = 0; i < lab.PlaneSize(); ++i) {
    const LabColor a{lab.Plane(0)[i], lab.Plane(1)[i], lab.Plane(2)[i]};
    const LabColor b{lab.Plane(0)[i], other.Plane(1)[i], other.Plane(2)[i]};
    sum += DeltaE00(a, b);
  }
  return sum / static_cast<double>(lab.PlaneSize());
}

// The colours of the splat are the truth; `colored`: the result for its grey copy.
nlohmann::ordered_json CompareColors(const ViewerGaussians& truth,
                                     const ViewerGaussians& colored,
                                     const SplatScene& splat,
                                     const std::filesystem::path& folder,
                                     ThreadPool& pool) {
  double error = 0.0, gray_error = 0.0;
  for (const View& view : splat.scene.views) {
    Pose pose = view.cam_from_world;  // in the file's frame
    pose.translation = -(pose.rotation * splat.scene.WorldFromScene(pose.Center()));
    const Image wanted = RenderForViewers(truth, view.camera, pose, pool);
    const Image made = RenderForViewers(colored, view.camera, pose, pool);
    error += MeanDifference(wanted, made);
    gray_error += MeanDifference(wanted, Image(wanted.width, wanted.height, 3, 0.5f));
    if (folder.empty()) continue;
    WriteFileAtomic(folder / ("truth_" + view.name), EncodePng8(wanted));
    WriteFileAtomic(folder / ("colored_" + view.name), EncodePng8(made));
  }
  const auto count = static_cast<double>(splat.scene.views.size());
  return {{"delta_e00_chroma", error / count}, {"delta_e00_chroma_gray", gray_error / count}};
}

// Compares with the cameras of the photos that the splat was trained on.
nlohmann::ordered_json CompareWithCapture(const SplatScene& splat,
                                          const Scene& capture,
                                          ThreadPool& pool) {
  const Scene& scene = splat.scene;
  SeenGaussians seen(splat.geometry, scene.views.at(0).camera, pool);
  // Upright cameras have level right axes at any pitch.
  Eigen::Matrix3d rights = Eigen::Matrix3d::Zero(), chosen_rights = Eigen::Matrix3d::Zero();
  double captured = 0.0, chosen = 0.0;
  std::vector<Eigen::Vector3d> forward;
  for (const View& view : capture.views) {
    Pose pose = view.cam_from_world;
    const Eigen::Vector3d center =
        (capture.WorldFromScene(pose.Center()) - scene.world_offset) / scene.world_from_scene_scale;
    pose.translation = -(pose.rotation * center);
    const SeenGaussians::Measure measure = seen.At(pose, 1e-9);
    captured += measure.seen / static_cast<double>(capture.views.size());
    const Eigen::Vector3d right = pose.rotation.conjugate() * Eigen::Vector3d::UnitX();
    rights += right * right.transpose();
    forward.push_back(pose.rotation.conjugate() * Eigen::Vector3d::UnitZ());
  }
  double farthest = 0.0, mean = 0.0;
  for (const View& view : scene.views) {
    chosen += seen.At(view.cam_from_world, 1e-9).seen / static_cast<double>(scene.views.size());
    const Eigen::Vector3d right =
        view.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitX();
    chosen_rights += right * right.transpose();
    const Eigen::Vector3d mine =
        view.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
    double nearest = 4.0;
    for (const Eigen::Vector3d& other : forward) {
      nearest = std::min(nearest, std::acos(std::clamp(mine.dot(other), -1.0, 1.0)));
    }
    farthest = std::max(farthest, nearest);
    mean += nearest / static_cast<double>(scene.views.size());
  }
  constexpr double kDegrees = 57.29577951308232;
  const auto level = [](const Eigen::Matrix3d& m) -> Eigen::Vector3d {
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(m).eigenvectors().col(0);
  };
  const double tilt = std::acos(std::min(1.0, std::abs(level(rights).dot(level(chosen_rights)))));
  return {{"seen_by_chosen_over_captured", chosen / captured},
          {"up_error_degrees", kDegrees * tilt},
          {"mean_degrees_from_a_captured_direction", kDegrees * mean},
          {"most_degrees_from_a_captured_direction", kDegrees * farthest}};
}

void RunSplatViews(const SplatViewArguments& args) {
  QuietRun run;
  ThreadPool& pool = run.pool();
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
  if (!args.colored_file.empty()) {
    report["colors"] =
        CompareColors(original, ReadSplat(ReadFile(args.colored_file)), splat, args.folder, pool);
  }
  WriteResult(report, args.json_file);
}

}  // namespace

void AddSplatViewsCommand(CLI::App& app) {
  auto args = std::make_shared<SplatViewArguments>();
  CLI::App* command = app.add_subcommand(
      "splat-views", "Measure the views chosen for a splat, and its loss in grey");
  command->add_option("--splat", args->splat_file, "Splat file (PLY, SOG or SPZ)")->required();
  command->add_option(
      "--scene", args->scene_file, "scene.json of the photos that the splat was trained on");
  command->add_option(
      "--colored", args->colored_file, "Result of `color3d colorize` for the splat's grey copy");
  command->add_option("--views", args->options.views, "Number of views")->capture_default_str();
  command->add_option("--side", args->options.side_px, "Longer side of the views, px")
      ->capture_default_str();
  command->add_option("--out", args->folder, "Folder for the views; default: none");
  command->add_option(
      "--json", args->json_file, "File for the result (JSON); default: standard output");
  command->callback([args] { RunSplatViews(*args); });
}

}  // namespace color3d
