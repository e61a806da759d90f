// color3d-bench pipeline: runs all stages on a colour scene in benchmark mode, without a server.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/catalogue/stages.h"
#include "core/stage/formats/artifact_io.h"
#include "tests/bench/commands.h"
#include "tests/bench/local_pipeline.h"
#include "tests/bench/training_scores.h"

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
  CarryColorOptions carrying;
  ColorizeViewsOptions coloring;
  bool paper = false;
  bool feed_forward = false;
  bool carry = true;
  bool bound = false;
  bool rescore = false;
  std::string geometry_file;
  std::string earlier_folder;
  std::string from_stage;
  bool score_training = false;
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

// Returns true if the stage comes before the first one to run. Its artifacts are then taken from
// the earlier run.
bool TakeEarlier(const PipelineArguments& args, const char* kind, LocalPipeline* pipeline) {
  if (args.earlier_folder.empty()) return false;
  const std::vector<Stage>& stages = StageCatalogue();
  const auto place = [&](std::string_view name) {
    return std::find_if(
        stages.begin(), stages.end(), [&](const Stage& stage) { return name == stage.kind; });
  };
  if (place(args.from_stage) == stages.end()) {
    throw InvalidArgument("--from: there is no stage '{}'", args.from_stage);
  }
  if (place(kind) >= place(args.from_stage)) return false;
  for (const std::string& name : ListFiles(args.earlier_folder)) {
    const Stage* stage = FindProducer(name);
    if (stage != nullptr && std::string_view(kind) == stage->kind) {
      pipeline->Take(name, std::filesystem::path(args.earlier_folder) / name);
    }
  }
  return true;
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
  const auto run = [&](const char* kind, const std::function<void(StageContext&)>& stage) {
    if (!TakeEarlier(args, kind, &pipeline)) pipeline.Run(kind, stage);
  };
  if (!TakeEarlier(args, kind::kImportScene, &pipeline)) pipeline.ImportScene();
  if (!TakeEarlier(args, kind::kSelectKeyView, &pipeline)) pipeline.SelectKeyView(args.key_view);
  const Scene scene = SceneFromJson(ReadFile(pipeline.ArtifactPath(artifact::kScene)));
  run(kind::kColorizeKeyView, [&](StageContext& c) {
    ColorizeKeyViewOptions options;
    options.file = c.scene_folder() / scene.views[ReadKeyView(c, scene)].image_file;
    RunColorizeKeyView(options, c);
  });
  if (args.geometry_file.empty()) {
    run(kind::kReconstructGeometry,
        [&](StageContext& c) { RunReconstructGeometry(args.geometry, args.max_side_px, c); });
  } else {
    pipeline.Take(artifact::kGeometry, args.geometry_file);
  }
  if (args.carry) {
    run(kind::kCarryColor, [&](StageContext& c) {
      CarryColorOptions options = args.carrying;
      options.max_side_px = args.max_side_px;
      RunCarryColor(options, c);
    });
  }
  ColorizerOptions colorizer = args.colorizer;
  if (args.paper) colorizer.UsePaperRecipe();
  if (args.feed_forward) colorizer.recipe = ColorizerOptions::Recipe::kFeedForward;
  run(kind::kPersonalize, [&](StageContext& c) { RunPersonalize(colorizer, c); });
  run(kind::kColorizeViews, [&](StageContext& c) {
    ColorizeViewsOptions options = args.coloring;
    options.max_side_px = args.max_side_px;
    RunColorizeViews(options, c);
  });
  run(kind::kSolveChroma, [&](StageContext& c) { RunSolveChroma(args.chroma, c); });
  if (args.score_training) {
    pipeline.Run("score_training", [&](StageContext& c) {
      std::printf("%s\n", ScoreTrainingViews(c).dump(1).c_str());
    });
    return;
  }
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
      "pipeline", "Run all stages on colour photos in benchmark mode, in one process");
  command
      ->add_option("--scene", args->scene_folder, "Folder of colour photos, with or without poses")
      ->required();
  command->add_option("--out", args->out_folder, "Folder for artifacts and the report")->required();
  command->add_option("--max-side", args->max_side_px, "Longer side of the working pictures, px");
  command->add_option("--threads", args->threads, "Number of threads");
  command->add_option("--seed", args->seed, "Seed");
  command->add_option("--key-view", args->key_view, "Name of the key view; default: selected");
  command->add_option("--geometry-iterations",
                      args->geometry.iterations,
                      "Training iterations of the luminance Gaussians");
  command->add_option(
      "--max-gaussians", args->geometry.max_gaussians, "Maximum number of Gaussians");
  command->add_option(
      "--colorizer-iterations", args->colorizer.iterations, "Iterations of personalization");
  command->add_option(
      "--chroma-iterations", args->chroma.iterations, "Iterations of the chroma solver");
  command->add_flag("--carry,!--no-carry",
                    args->carry,
                    "Carry the key view's colours through the geometry (default), or not");
  command->add_option("--depth-sources",
                      args->carrying.depth_sources,
                      "Photos that the plane sweep of each view compares; 0: no plane sweep");
  command->add_option("--flow-tolerance",
                      args->carrying.carry.flow_tolerance_px,
                      "Tolerance of carried positions, px of optical flow; 0: no check by flow");
  command->add_flag("--augment,!--no-augment",
                    args->colorizer.augment,
                    "Transform the training pictures of the colorizer (default), or not");
  command->add_flag("--guess,!--no-guess",
                    args->coloring.guess,
                    "Guess where nothing similar has a colour (default), or not");
  command->add_flag("--spread,!--no-spread",
                    args->coloring.spread,
                    "Spread colours between the edges of the luminance (default), or not");
  command->add_flag(
      "--feed-forward", args->feed_forward, "Use the general colorizer, without training");
  command->add_flag("--paper", args->paper, "Use the paper's colorizer recipe");
  command
      ->add_option("--geometry",
                   args->geometry_file,
                   "geometry.c3g of an earlier run of the scene at this size, instead of training")
      ->check(CLI::ExistingFile);
  command->add_flag("--rescore", args->rescore, "Only evaluate what an earlier run wrote to --out");
  CLI::Option* from =
      command->add_option("--from", args->from_stage, "First stage to run, e.g. colorize_views");
  command
      ->add_option(
          "--earlier", args->earlier_folder, "Output folder of the run with the stages before it")
      ->check(CLI::ExistingDirectory)
      ->needs(from);
  command->add_flag(
      "--score-training",
      args->score_training,
      "Score the training views other than the key view, to choose constants; exports nothing");
  command->add_flag(
      "--bound", args->bound, "Also score the same geometry with the true colours of all views");
  command->callback([args] { RunPipeline(*args); });
}

}  // namespace color3d
