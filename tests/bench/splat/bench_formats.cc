#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/scene/scene.h"
#include "core/splat/export/glb/glb.h"
#include "core/splat/export/sog/sog.h"
#include "core/splat/export/spz/spz.h"
#include "tests/bench/commands.h"
#include "tests/bench/result_file.h"
#include "tests/support/formats/viewer_files.h"

namespace color3d {
namespace {

struct FormatArguments {
  std::string ply_file;
  std::string scene_file;
  std::vector<std::string> others;
  std::string folder;
  std::string json_file;
};

struct FileView {
  Camera camera;
  Pose cam_from_file;
};

// Cameras of the scene in the coordinates of its files.
std::vector<FileView> ViewsOf(const Scene& scene, int max_side_px) {
  const ExportFrame frame = ExportFrameOf(scene);
  std::vector<FileView> views;
  for (const View& view : scene.views) {
    Pose pose = view.cam_from_world;
    pose.translation = frame.scale * pose.translation - pose.rotation * frame.offset;
    views.push_back({view.camera.FitWithin(max_side_px), pose});
  }
  return views;
}

void RunFormats(const FormatArguments& args) {
  ThreadPool pool;
  const std::string ply = ReadFile(args.ply_file);
  const ViewerGaussians original = ReadPly(ply);
  const std::vector<FileView> views = ViewsOf(SceneFromJson(ReadFile(args.scene_file)), 500);
  std::vector<Image> pictures;
  for (const FileView& view : views) {
    pictures.push_back(RenderForViewers(original, view.camera, view.cam_from_file, pool));
  }
  nlohmann::ordered_json report = {{"gaussians", original.size()}, {"ply_bytes", ply.size()}};
  const auto compare = [&](const ViewerGaussians& gaussians, nlohmann::ordered_json* to) {
    double sum = 0.0, least = 99.0;
    for (size_t v = 0; v < views.size(); ++v) {
      const double psnr = PsnrOf(
          pictures[v], RenderForViewers(gaussians, views[v].camera, views[v].cam_from_file, pool));
      sum += psnr;
      least = std::min(least, psnr);
    }
    (*to)["gaussians"] = gaussians.size();
    (*to)["psnr_db"] = sum / static_cast<double>(views.size());
    (*to)["worst_psnr_db"] = least;
  };
  const auto measure = [&](const std::string& name,
                           const std::function<std::string()>& encode,
                           const std::function<ViewerGaussians(std::string_view)>& read) {
    const auto start = std::chrono::steady_clock::now();
    const std::string bytes = encode();
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    nlohmann::ordered_json& row = report["formats"][name];
    row["seconds"] = seconds.count();
    row["bytes"] = bytes.size();
    row["ply_ratio"] = static_cast<double>(ply.size()) / static_cast<double>(bytes.size());
    compare(read(bytes), &row);
    if (!args.folder.empty()) {
      std::filesystem::create_directories(args.folder);
      WriteFileAtomic(std::filesystem::path(args.folder) / name, bytes);
    }
  };
  measure(
      "scene.sog", [&] { return EncodeSog(original, pool); }, [](auto b) { return ReadSog(b); });
  const auto spz = [&](SpzVersion version) {
    return [&original, &pool, version] { return EncodeSpz(original, version, pool); };
  };
  measure("scene.spz", spz(SpzVersion::k4), [](auto b) { return ReadSpz(b); });
  measure("version2.spz", spz(SpzVersion::k2), [](auto b) { return ReadSpz(b); });
  measure(
      "scene.glb", [&] { return EncodeGlb(original); }, ReadGlb);
  for (const std::string& file : args.others) {
    const std::string bytes = ReadFile(file);
    nlohmann::ordered_json& row = report["others"][file];
    compare(ReadPly(bytes), &row);
  }
  WriteResult(report, args.json_file);
}

}  // namespace

void AddFormatsCommand(CLI::App& app) {
  auto args = std::make_shared<FormatArguments>();
  CLI::App* command =
      app.add_subcommand("formats", "Measure size, time and quality of the files for viewers");
  command->add_option("--ply", args->ply_file, "scene.ply of a scene")->required();
  command
      ->add_option("--scene", args->scene_file, "scene.json of the scene, whose views are rendered")
      ->required();
  command->add_option(
      "--other", args->others, "Additional PLY files to compare, converted by other tools");
  command->add_option("--out", args->folder, "Folder for the files; default: none");
  command->add_option(
      "--json", args->json_file, "File for the result (JSON); default: standard output");
  command->callback([args] { RunFormats(*args); });
}

}  // namespace color3d
