// color3d-bench augmentations: writes generated training pictures of a colour scene, for viewing
// and for color3d-bench colorizer --pictures.
#include <cstdio>

#include "core/base/files.h"
#include "core/stage/formats/artifact_io.h"
#include "tests/bench/commands.h"
#include "tests/bench/local_pipeline.h"

namespace color3d {
namespace {

struct AugmentationsArguments {
  std::string scene_folder;
  std::string out_folder;
  std::string key_view;
  int threads = 2;
  uint64_t seed = 1;
  bool no_geometry = false;
  GeometryOptions geometry{.iterations = 3000, .max_gaussians = 150'000};
  AugmentationOptions options;
};

// Middle view, as in color3d-bench colorizer.
std::string MiddleView(const Scene& scene) {
  for (size_t i = scene.views.size() / 2; i < scene.views.size(); ++i) {
    if (!scene.views[i].held_out) return scene.views[i].name;
  }
  return scene.views.front().name;
}

void RunAugmentations(const AugmentationsArguments& args) {
  LocalPipeline pipeline(
      args.scene_folder, args.out_folder, args.threads, args.seed, [](const std::string& text) {
        std::fprintf(stderr, "%s\n", text.c_str());
      });
  pipeline.ImportScene();
  const Scene scene = SceneFromJson(ReadFile(pipeline.ArtifactPath(artifact::kScene)));
  pipeline.Run("select_key_view", [&](StageContext& c) {
    SelectKeyViewOptions options;
    options.selection.strategy = KeyViewStrategy::kManual;
    options.view = args.key_view.empty() ? MiddleView(scene) : args.key_view;
    RunSelectKeyView(options, c);
  });
  pipeline.Run("colorize_key_view", [&](StageContext& c) {
    ColorizeKeyViewOptions options;
    options.file = c.scene_folder() / scene.views[ReadKeyView(c, scene)].image_file;
    RunColorizeKeyView(options, c);
  });
  if (!args.no_geometry) {
    pipeline.Run("reconstruct_geometry",
                 [&](StageContext& c) { RunReconstructGeometry(args.geometry, 500, c); });
  }
  pipeline.Run("generate_augmentations",
               [&](StageContext& c) { RunGenerateAugmentations(args.options, c); });
  std::printf("%s", ReadFile(pipeline.ArtifactPath(artifact::kAugmentationFacts)).c_str());
}

}  // namespace

void AddAugmentationsCommand(CLI::App& app) {
  auto args = std::make_shared<AugmentationsArguments>();
  CLI::App* command = app.add_subcommand(
      "augmentations",
      "Generate additional training pictures from one key view of posed colour photos");
  command
      ->add_option("--scene", args->scene_folder, "Folder of colour photos, with or without poses")
      ->required();
  command->add_option("--out", args->out_folder, "Folder for artifacts")->required();
  command->add_option(
      "--key-view", args->key_view, "Name of the key view; default: the middle training view");
  command->add_option("--samples", args->options.samples, "Number of pictures");
  command->add_option(
      "--side", args->options.max_side_px, "Longer side of the working pictures, px");
  command->add_option("--threads", args->threads, "Number of threads");
  command->add_option("--seed", args->seed, "Seed");
  command->add_option("--geometry-iterations",
                      args->geometry.iterations,
                      "Training iterations of the luminance Gaussians");
  command->add_option(
      "--max-gaussians", args->geometry.max_gaussians, "Maximum number of Gaussians");
  command->add_flag("--no-geometry", args->no_geometry, "Use the key view alone");
  command->callback([args] { RunAugmentations(*args); });
}

}  // namespace color3d
