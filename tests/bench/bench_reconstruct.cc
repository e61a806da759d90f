// color3d-bench reconstruct: luminance geometry alone, held-out PSNR against time.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/report/curves.h"
#include "core/splat/trainer.h"
#include "core/stage/stages.h"
#include "tests/bench/commands.h"

namespace color3d {
namespace {

struct ReconstructArguments {
  std::string scene_folder;
  std::string json_file;
  int max_side_px = 500;
  int threads = 2;
  GeometryOptions geometry;
};

void RunReconstruct(const ReconstructArguments& args) {
  NullObserver silent;
  NoCheckpoints none;
  CancellationToken cancel;
  const ScratchFolder scratch;
  ImportOptions import_options;
  import_options.hold_out_every_eighth = true;
  const ImportResult imported =
      ImportScene(args.scene_folder, scratch.path(), import_options, silent, cancel);
  const ViewImages images(imported.scene, args.scene_folder, args.max_side_px);
  for (size_t i = 0; i < imported.scene.views.size(); ++i) images.Luminance(static_cast<int>(i));
  ThreadPool pool(args.threads);
  CurveRecorder recorder("reconstruct_geometry", silent, none);
  const GaussianModel model =
      TrainGeometry(imported.scene, images, args.geometry, pool, recorder, recorder, cancel);
  nlohmann::ordered_json result{
      {"scene", args.scene_folder},
      {"max_side_px", args.max_side_px},
      {"threads", args.threads},
      {"iterations", args.geometry.iterations},
      {"seconds", recorder.Seconds()},
      {"ms_per_iteration", 1000.0 * recorder.Seconds() / std::max(1, args.geometry.iterations)},
      {"gaussians", model.size()}};
  for (const CurvePoint& p : recorder.points()) {
    result["curve"].push_back({{"seconds", p.seconds},
                               {"iteration", p.iteration},
                               {"error_name", p.error_name},
                               {"value", p.value}});
  }
  const std::string text = result.dump(1) + "\n";
  if (args.json_file.empty()) {
    std::printf("%s", text.c_str());
  } else {
    WriteFileAtomic(args.json_file, text);
  }
}

}  // namespace

void AddReconstructCommand(CLI::App& app) {
  auto args = std::make_shared<ReconstructArguments>();
  CLI::App* command = app.add_subcommand(
      "reconstruct", "luminance geometry of a scene: held-out PSNR against seconds");
  command->add_option("--scene", args->scene_folder)->required();
  command->add_option("--max-side", args->max_side_px, "px");
  command->add_option("--threads", args->threads);
  command->add_option("--iterations", args->geometry.iterations);
  command->add_option("--max-gaussians", args->geometry.max_gaussians);
  command->add_option("--sh-degree", args->geometry.sh_degree);
  command->add_option("--json", args->json_file, "default: standard output");
  command->callback([args] { RunReconstruct(*args); });
}

}  // namespace color3d
