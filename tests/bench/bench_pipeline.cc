// color3d-bench pipeline: a colour scene end to end in benchmark mode, without server.
#include <cstdio>

#include "core/base/files.h"
#include "core/catalogue/stages.h"
#include "core/stage/formats/artifacts.h"
#include "tests/bench/commands.h"
#include "tests/bench/local_pipeline.h"

namespace color3d {
namespace {

struct PipelineArguments {
  std::string scene_folder;
  std::string out_folder;
  int max_side_px = 500;
  int threads = 2;
  uint64_t seed = 1;
  std::string key_view;
  GeometryOptions geometry{.iterations = 3000, .max_gaussians = 150'000};
  ColorizerOptions colorizer{.iterations = 800};
  ChromaOptions chroma{.iterations = 600};
  bool paper = false;
  bool carry = true;
  bool bound = false;
  bool rescore = false;
  std::string geometry_file;
};

// The scene folder has the true colours of all views.
void Evaluate(const PipelineArguments& args, const Scene& scene, StageContext& context) {
  EvaluateOptions options;
  options.bound = args.bound;
  options.chroma = args.chroma;
  for (const View& view : scene.views) {
    auto& truth = view.held_out ? options.truth : options.training_truth;
    truth.push_back({view.name, context.scene_folder() / view.image_file});
  }
  RunEvaluate(options, context);
}

void RunPipeline(const PipelineArguments& args) {
  LocalPipeline pipeline(
      args.scene_folder, args.out_folder, args.threads, args.seed, [](const std::string& text) {
        std::fprintf(stderr, "%s\n", text.c_str());
      });
  if (args.rescore) {
    pipeline.TakeAll();
    const Scene scene = SceneFromJson(ReadFile(pipeline.ArtifactPath(artifact::kScene)));
    pipeline.Run(kind::kEvaluate, [&](StageContext& c) { Evaluate(args, scene, c); });
    std::printf("%s", ReadFile(pipeline.ArtifactPath(artifact::kScores)).c_str());
    return;
  }
  pipeline.ImportScene();
  pipeline.Run(kind::kSelectKeyView, [&](StageContext& c) {
    SelectKeyViewOptions options;
    options.view = args.key_view;
    if (!args.key_view.empty()) options.selection.strategy = KeyViewStrategy::kManual;
    RunSelectKeyView(options, c);
  });
  const Scene scene = SceneFromJson(ReadFile(pipeline.ArtifactPath(artifact::kScene)));
  pipeline.Run(kind::kColorizeKeyView, [&](StageContext& c) {
    ColorizeKeyViewOptions options;
    options.file = c.scene_folder() / scene.views[ReadKeyView(c, scene)].image_file;
    RunColorizeKeyView(options, c);
  });
  if (args.geometry_file.empty()) {
    pipeline.Run(kind::kReconstructGeometry, [&](StageContext& c) {
      RunReconstructGeometry(args.geometry, args.max_side_px, c);
    });
  } else {
    pipeline.Take(artifact::kGeometry, args.geometry_file);
  }
  if (args.carry) {
    pipeline.Run(kind::kCarryColor, [&](StageContext& c) {
      CarryColorOptions options;
      options.max_side_px = args.max_side_px;
      RunCarryColor(options, c);
    });
  }
  ColorizerOptions colorizer = args.colorizer;
  if (args.paper) colorizer.recipe = ColorizerOptions::Recipe::kPaper;
  pipeline.Run(kind::kPersonalize, [&](StageContext& c) { RunPersonalize(colorizer, c); });
  pipeline.Run(kind::kColorizeViews,
               [&](StageContext& c) { RunColorizeViews(args.max_side_px, c); });
  pipeline.Run(kind::kSolveChroma, [&](StageContext& c) { RunSolveChroma(args.chroma, c); });
  pipeline.Run(kind::kExport, [&](StageContext& c) { RunExport({}, c); });
  pipeline.Run(kind::kRender, [&](StageContext& c) {
    RenderOptions options;
    options.max_side_px = args.max_side_px;
    RunRender(options, c);
  });
  pipeline.Run(kind::kEvaluate, [&](StageContext& c) { Evaluate(args, scene, c); });
  pipeline.Run(kind::kColorizeScene, [&](StageContext& c) { RunReport(pipeline.summaries(), c); });
  std::printf("%s", ReadFile(pipeline.ArtifactPath(artifact::kMetrics)).c_str());
}

}  // namespace

void AddPipelineCommand(CLI::App& app) {
  auto args = std::make_shared<PipelineArguments>();
  CLI::App* command = app.add_subcommand(
      "pipeline", "photos in colour -> coloured scene and its score, all stages in this process");
  command->add_option("--scene", args->scene_folder, "folder of photos, with or without poses")
      ->required();
  command->add_option("--out", args->out_folder, "where artifacts and the report go")->required();
  command->add_option("--max-side", args->max_side_px, "working size, px");
  command->add_option("--threads", args->threads);
  command->add_option("--seed", args->seed);
  command->add_option("--key-view", args->key_view, "instead of the selected one");
  command->add_option("--geometry-iterations", args->geometry.iterations);
  command->add_option("--max-gaussians", args->geometry.max_gaussians);
  command->add_option("--colorizer-iterations", args->colorizer.iterations);
  command->add_option("--chroma-iterations", args->chroma.iterations);
  command->add_flag("--carry,!--no-carry", args->carry, "geometry first");
  command->add_flag("--paper", args->paper, "the paper's colorizer recipe");
  command
      ->add_option("--geometry",
                   args->geometry_file,
                   "geometry.c3g of an earlier run of the scene at this size, in place of training")
      ->check(CLI::ExistingFile);
  command->add_flag(
      "--rescore", args->rescore, "run evaluation alone, on what an earlier run left in --out");
  command->add_flag(
      "--bound", args->bound, "also score the same geometry under the true colours of all views");
  command->callback([args] { RunPipeline(*args); });
}

}  // namespace color3d
