// color3d-bench key-choice: how good the selected key view is. Colours a scene or film from each of
// several key views and compares the measured errors with those that the selection expects.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/base/evenly.h"
#include "core/base/files.h"
#include "core/catalogue/stages.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/keyview/collect_features.h"
#include "core/metrics/view_scores.h"
#include "core/scene/view_images.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/sources/seen_samples.h"
#include "tests/bench/commands.h"
#include "tests/bench/local_pipeline.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

struct KeyChoiceArguments {
  std::string scene_folder, run_folder, out_folder;
  int candidates = 8;
  int side_px = 320;
  int iterations = 60;
  int threads = 2;
};

class KeyChoice {
 public:
  KeyChoice(const KeyChoiceArguments& args, const fs::path& scene_folder)
      : args_(args),
        scene_folder_(scene_folder),
        pipeline_(scene_folder, args.out_folder, args.threads, 1, {}) {}

  ordered_json Run() {
    if (args_.run_folder.empty()) {
      pipeline_.ImportScene();
    } else {
      for (const char* name : {artifact::kScene, artifact::kGeometry}) {
        pipeline_.Take(name, fs::path(args_.run_folder) / name);
      }
    }
    scene_ = SceneFromJson(ReadFile(pipeline_.ArtifactPath(artifact::kScene)));
    training_ = scene_.TrainingViews();
    pipeline_.SelectKeyView("");
    const auto selected =
        nlohmann::json::parse(ReadFile(pipeline_.ArtifactPath(artifact::kKeyView))).at("view");
    ordered_json json{{"selected", selected}};
    std::vector<int> tried = Tried();
    const int chosen = scene_.FindView(selected.get<std::string>());
    if (!std::ranges::count(tried, chosen)) tried.push_back(chosen);
    AddExpected(tried, &json);
    for (const int key : tried) {
      json["tried"].push_back(Colored(key));
      std::fprintf(stderr, "%s\n", json["tried"].back().dump().c_str());
    }
    return json;
  }

 private:
  // Evenly spread, from the middles of equal parts.
  std::vector<int> Tried() const {
    const size_t count = std::min<size_t>(args_.candidates, training_.size());
    std::vector<int> tried;
    for (size_t k = 0; k < count; ++k) {
      tried.push_back(training_[(2 * k + 1) * training_.size() / (2 * count)]);
    }
    return tried;
  }

  // Mean distance of the features of all views to those of each tried one, and its expected error;
  // smaller is better.
  void AddExpected(const std::vector<int>& tried, ordered_json* json) const {
    ThreadPool pool(args_.threads);
    NoCheckpoints none;
    NullObserver silent;
    const CancellationToken cancel;
    const RunControl run{pool, none, silent, cancel};
    std::vector<fs::path> photos;
    for (const int view : training_)
      photos.push_back(scene_folder_ / scene_.views[view].image_file);
    const auto encoder = Encoder::Embedded();
    const auto features = CollectViewFeatures(*encoder, *encoder, photos, "", run);
    const std::vector<bool> all(training_.size(), true);
    const NearestDistances distances = FindNearestDistances(features, all, run);
    const std::vector<double> coverage = MeanFeatureDistances(features, all, run);
    const int count = static_cast<int>(training_.size());
    const SeenSamples seen =
        args_.run_folder.empty()
            ? SeenSamples(count, 0)
            : SeenByGeometry(scene_,
                             training_,
                             ParseGaussians(ReadFile(pipeline_.ArtifactPath(artifact::kGeometry))),
                             GridFor(count),
                             pool,
                             cancel);
    for (const int view : tried) {
      const int key = static_cast<int>(std::ranges::find(training_, view) - training_.begin());
      (*json)["expected"].push_back({{"view", scene_.views[view].name},
                                     {"coverage", coverage[key]},
                                     {"expected_error", ExpectedError(seen, distances, {key})}});
    }
  }

  ordered_json Colored(int key) {
    pipeline_.SelectKeyView(scene_.views[key].name);
    pipeline_.Run(kind::kColorizeKeyView, [&](StageContext& context) {
      RunColorizeKeyView({.file = context.scene_folder() / scene_.views[key].image_file}, context);
    });
    pipeline_.Run(kind::kCarryColor, [&](StageContext& context) {
      CarryColorOptions options;
      options.max_side_px = args_.side_px;
      RunCarryColor(options, context);
    });
    pipeline_.Run(kind::kPersonalize, [&](StageContext& context) {
      ColorizerOptions options;
      options.iterations = args_.iterations;
      options.max_side_px = args_.side_px;
      RunPersonalize(options, context);
    });
    pipeline_.Run(kind::kColorizeViews, [&](StageContext& context) {
      RunColorizeViews({.max_side_px = args_.side_px}, context);
    });
    std::vector<int> others = training_;
    std::erase(others, key);
    return {{"view", scene_.views[key].name},
            {"training", ErrorOf(others)},
            {"held_out", ErrorOf(scene_.HeldOutViews())}};
  }

  // Mean chroma error of up to 24 of the views.
  double ErrorOf(const std::vector<int>& of) const {
    const std::vector<int> views = PickEvenly(of, 24);
    const ViewImages images(scene_, scene_folder_, args_.side_px, 0);
    double error = 0.0;
    for (const int index : views) {
      const std::string name = ViewArtifact(artifact::kViewsAb, scene_.views[index], ".png");
      const AbMap map = DecodeAbPng(ReadFile(pipeline_.ArtifactPath(name)), name);
      const auto luminance = images.Luminance(index);
      error +=
          ChromaError(images.Srgb(index),
                      JoinLab(*luminance, Resize(map.ab, luminance->width, luminance->height)));
    }
    return error / static_cast<double>(std::max<size_t>(1, views.size()));
  }

  const KeyChoiceArguments& args_;
  fs::path scene_folder_;
  LocalPipeline pipeline_;
  Scene scene_;
  std::vector<int> training_;
};

}  // namespace

void AddKeyChoiceCommand(CLI::App& app) {
  auto args = std::make_shared<KeyChoiceArguments>();
  CLI::App* command = app.add_subcommand(
      "key-choice", "Compare measured errors of several key views with those that are expected");
  command
      ->add_option(
          "--scene", args->scene_folder, "Folder of colour photos with poses, or of colour frames")
      ->required()
      ->check(CLI::ExistingDirectory);
  command->add_option(
      "--run", args->run_folder, "Output folder of a `pipeline` run, for scenes with poses");
  command->add_option("--out", args->out_folder, "Folder for artifacts")->required();
  command->add_option("--candidates", args->candidates, "Number of key views tried, evenly spread");
  command->add_option("--side", args->side_px, "Longer side of the working pictures, px");
  command->add_option("--iterations", args->iterations, "Iterations of personalization");
  command->add_option("--threads", args->threads, "Number of threads");
  command->callback(
      [args] { std::printf("%s\n", KeyChoice(*args, args->scene_folder).Run().dump(1).c_str()); });
}

}  // namespace color3d
