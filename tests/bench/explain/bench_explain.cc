// color3d-bench explain: why a personalized colorizer gives one surface one colour in all views.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/catalogue/stages.h"
#include "core/color/lab_planes.h"
#include "core/encoder/torch_errors.h"
#include "core/encoder/torch_threads.h"
#include "core/image/codec.h"
#include "tests/bench/colorizer/bench_encoder.h"
#include "tests/bench/commands.h"
#include "tests/bench/explain/explain_report.h"
#include "tests/bench/explain/explain_scene.h"
#include "tests/bench/explain/model_study.h"
#include "tests/bench/local_pipeline.h"
#include "tests/bench/result_file.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

constexpr int kShownViews = 5;
// Of the preset "fast".
constexpr int kGeometryIterations = 1500;
constexpr int kMaxGaussians = 40'000;

struct ExplainArguments {
  std::string scene_folder, run_folder, out_folder, key_view;
  std::string encoder = "embedded";
  std::vector<double> lambdas = {0.0, 0.1, 1.0, 10.0};
  int side_px = 400;
  int views = 16;
  int threads = 2;
  bool paper = false;
  ColorizerOptions options;
  StudySizes sizes;
};

ColorizerOptions OptionsFrom(const ExplainArguments& args) {
  ColorizerOptions options = args.options;
  if (args.paper) options.UsePaperRecipe();
  options.max_side_px = args.side_px;
  options.precision = ColorizerOptions::Precision::kFloat32;
  options.Validate();
  return options;
}

// The key view, and others evenly spread.
std::vector<int> ShownViews(const ExplainScene& scene) {
  std::vector<int> shown = {scene.key};
  const int count = static_cast<int>(scene.views.size());
  for (int i = 0; i < kShownViews; ++i) {
    const int view = i * (count - 1) / (kShownViews - 1);
    if (std::find(shown.begin(), shown.end(), view) == shown.end() &&
        static_cast<int>(shown.size()) < kShownViews) {
      shown.push_back(view);
    }
  }
  return shown;
}

Image PictureOf(const ExplainScene& scene,
                const ModelStudies& studies,
                const PersonalModel& before,
                const PersonalModel& after) {
  std::vector<FeatureColumn> columns;
  for (const int view : ShownViews(scene)) {
    const std::string note = view == scene.key ? " (key view)" : "";
    columns.push_back({scene.views[view].name + note,
                       scene.views[view].luminance,
                       studies.Maps(view, before),
                       studies.Maps(view, after)});
  }
  return FeaturePicture(columns);
}

std::shared_ptr<const TapEncoder> EncoderOf(const std::string& name) {
  auto encoder = std::dynamic_pointer_cast<const TapEncoder>(BenchEncoder(name));
  if (!encoder) {
    throw InvalidArgument("the encoder {} has no feature maps; give a ConvNeXt", name);
  }
  return encoder;
}

ExplainFacts FactsOf(const ExplainArguments& args,
                     const ExplainScene& scene,
                     const TapEncoder& encoder,
                     const PersonalModel& model) {
  ExplainFacts facts;
  const fs::path folder = fs::path(args.scene_folder).lexically_normal();
  facts.scene = (folder.has_filename() ? folder : folder.parent_path()).filename().string();
  facts.key_view = scene.views[scene.key].name;
  facts.encoder = encoder.description();
  facts.views = static_cast<int>(scene.views.size());
  facts.pairs = static_cast<int>(scene.pairs.size());
  facts.has_adapters = model.config().HasAdapters();
  for (int i = 0; i < encoder.config().StageCount(); ++i) {
    facts.strides.push_back(encoder.config().Stride(i));
  }
  return facts;
}

// The stages that surfaces shared by views come from. Returns their folder.
fs::path RunStages(const ExplainArguments& args) {
  const fs::path folder = fs::path(args.out_folder) / "run";
  LocalPipeline pipeline(
      args.scene_folder, folder, args.threads, args.options.seed, [](const std::string& text) {
        std::fprintf(stderr, "%s\n", text.c_str());
      });
  pipeline.ImportScene();
  pipeline.SelectKeyView(args.key_view);
  pipeline.Run(kind::kReconstructGeometry, [&](StageContext& c) {
    GeometryOptions geometry;
    geometry.iterations = kGeometryIterations;
    geometry.max_gaussians = kMaxGaussians;
    RunReconstructGeometry(geometry, args.side_px, c);
  });
  return folder;
}

void Run(const ExplainArguments& args) {
  const ColorizerOptions options = OptionsFrom(args);
  ThreadPool pool(args.threads);
  const fs::path run = args.run_folder.empty() ? RunStages(args) : fs::path(args.run_folder);
  const ExplainScene scene =
      ReadExplainScene(args.scene_folder, run, args.side_px, args.views, pool);
  const auto encoder = EncoderOf(args.encoder);
  const ExplainView& key_view = scene.views[scene.key];
  const TrainingPicture key{key_view.name, key_view.luminance, ChromaOfLab(key_view.lab)};
  const fs::path out = args.out_folder;
  fs::create_directories(out);
  SetTorchThreads(args.threads);
  const ModelStudies measure(scene, *encoder, args.sizes);
  const auto start = StartModel(*encoder, key, options);
  ExplainFacts facts = FactsOf(args, scene, *encoder, *start);
  facts.gray = measure.GrayError();
  std::vector<ModelStudy> studies = {measure.Measure("before training", 0.0, *start)};
  for (const double lambda : args.lambdas) {
    ColorizerOptions with_lambda = options;
    with_lambda.consistency_weight = lambda;
    with_lambda.Validate();
    const auto model = StartModel(*encoder, key, with_lambda);
    TrainModel(key, with_lambda, model.get());
    SetTorchThreads(args.threads);  // training sets one
    studies.push_back(measure.Measure(fmt::format("trained, λ = {}", lambda), lambda, *model));
    if (studies.size() == 2) {
      WriteFileAtomic(out / "features.png", EncodePng8(PictureOf(scene, measure, *start, *model)));
    }
    std::fprintf(stderr, "lambda %g: error %.3f\n", lambda, studies.back().delta_e00);
  }
  WriteResult(ExplainJson(facts, studies), (out / "explain.json").string());
  const std::string text = ExplainMarkdown(facts, studies);
  WriteFileAtomic(out / "explain.md", text);
  std::printf("%s", text.c_str());
}

}  // namespace

void AddExplainCommand(CLI::App& app) {
  auto args = std::make_shared<ExplainArguments>();
  CLI::App* command =
      app.add_subcommand("explain",
                         "Show why the colorizer is consistent: features and colours of matched "
                         "surfaces, the paper's bound, and the consistency term");
  command->add_option("scene,--scene", args->scene_folder, "Folder of colour photos")
      ->required()
      ->check(CLI::ExistingDirectory);
  CLI::Option* run = command->add_option(
      "--run",
      args->run_folder,
      "Output folder of a `pipeline` run; default: key view and geometry are made in OUT/run");
  command->add_option("--key-view", args->key_view, "Name of the key view; default: selected")
      ->excludes(run);
  command
      ->add_option("--out", args->out_folder, "Folder for explain.md, explain.json, features.png")
      ->required();
  command
      ->add_option("--lambda",
                   args->lambdas,
                   "Weights of the consistency term; the first one's features are drawn")
      ->capture_default_str();
  command->add_option("--encoder", args->encoder, "Encoder, as of `colorizer`")
      ->capture_default_str();
  command->add_option("--iterations", args->options.iterations, "Iterations of personalization")
      ->capture_default_str();
  command->add_option("--seed", args->options.seed, "Seed")->capture_default_str();
  command->add_flag("--paper", args->paper, "Use the paper's recipe");
  command->add_option("--side", args->side_px, "Longer side of the pictures, px")
      ->check(CLI::Range(128, 1024))
      ->capture_default_str();
  command->add_option("--views", args->views, "Number of views, besides the key view")
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  command->add_option("--draws", args->sizes.draws, "Augmentations of each picture")
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  command->add_option("--points", args->sizes.points, "Surface points for the bound")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command->add_option("--threads", args->threads, "Number of threads");
  command->callback([args] { WithTorchErrors("explain", [&] { Run(*args); }); });
}

}  // namespace color3d
