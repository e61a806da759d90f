// color3d-bench next-key: accuracy of the proposed additional key view. For a scene coloured from
// one key view, compares measured and expected errors over the training views for several second
// key views.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/catalogue/stages.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/keyview/collect_features.h"
#include "core/scene/view_images.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/sources/seen_samples.h"
#include "tests/bench/commands.h"
#include "tests/bench/local_pipeline.h"

namespace color3d {
namespace {

struct Arguments {
  std::string scene_folder, run_folder, out_folder;
  int candidates = 5;
  int side_px = 300;
  int iterations = 0;  // iterations of personalization; 0: neighbours only
  int threads = 2;
};

// Training views other than key views, in the order of the scene.
struct Problem {
  Scene scene;
  int key = 0;
  std::vector<int> candidates;
};

Problem ReadProblem(const Arguments& args) {
  const std::filesystem::path run = args.run_folder;
  Problem problem;
  problem.scene = SceneFromJson(ReadFile(run / artifact::kScene));
  problem.key = problem.scene.FindView(
      nlohmann::json::parse(ReadFile(run / artifact::kKeyView)).at("view").get<std::string>());
  std::vector<int> others = problem.scene.TrainingViews();
  std::erase(others, problem.key);
  const size_t count = std::min<size_t>(args.candidates, others.size());
  for (size_t k = 0; k < count; ++k) {
    problem.candidates.push_back(others[(2 * k + 1) * others.size() / (2 * count)]);
  }
  return problem;
}

// Colours all views from the key view and `second` (-1: none); the pipeline holds the result.
void ColorAll(const Arguments& args, const Problem& problem, int second, LocalPipeline* pipeline) {
  CarryColorOptions options;
  options.max_side_px = args.side_px;
  if (second >= 0) {
    const View& view = problem.scene.views[second];
    options.additional_key_views = {view.name};
    pipeline->Run(
        kind::kColorizeKeyView,
        [&](StageContext& c) {
          RunColorizeKeyView({.file = c.scene_folder() / view.image_file, .view = view.name}, c);
        },
        std::string(artifact::kKeyViews) + "1/");
  }
  pipeline->Run(kind::kCarryColor, [&](StageContext& c) { RunCarryColor(options, c); });
  pipeline->Run(kind::kPersonalize, [&](StageContext& c) {
    ColorizerOptions options;
    options.iterations = args.iterations;
    options.max_side_px = args.side_px;
    RunPersonalize(options, c);
  });
  pipeline->Run(kind::kColorizeViews,
                [&](StageContext& c) { RunColorizeViews({.max_side_px = args.side_px}, c); });
}

// Mean CIEDE2000 of the photos' colours under their true L, over all training views.
double TrainingError(const Arguments& args, const Problem& problem, const LocalPipeline& pipeline) {
  const ViewImages images(problem.scene, args.scene_folder, args.side_px, 0);
  double sum = 0.0;
  const std::vector<int> training = problem.scene.TrainingViews();
  for (const int index : training) {
    const View& view = problem.scene.views[index];
    const std::string name = ViewArtifact(artifact::kViewsAb, view, ".png");
    const AbMap map = DecodeAbPng(ReadFile(pipeline.ArtifactPath(name)), name);
    const Image truth = LabFromSrgb(images.Undistort(
        index, ReadImage(std::filesystem::path(args.scene_folder) / view.image_file)));
    sum += MeanDeltaE00(truth,
                        JoinLab(LuminanceOfLab(truth), Resize(map.ab, truth.width, truth.height)));
  }
  return sum / static_cast<double>(training.size());
}

// Baseline: number of points of structure-from-motion that the key view does not see, weighted by
// the number of views that see them.
double PointsGained(const Problem& problem, int second) {
  double gained = 0.0;
  for (const SparsePoint& point : problem.scene.points) {
    const auto sees = [&](int view) {
      return std::find(point.views.begin(), point.views.end(), view) != point.views.end();
    };
    if (sees(second) && !sees(problem.key)) gained += static_cast<double>(point.views.size());
  }
  return gained;
}

// Expected error of the key view with each candidate, and of the key view alone (last).
std::vector<double> ExpectedErrors(const Arguments& args,
                                   const Problem& problem,
                                   ThreadPool& pool) {
  const std::vector<int> training = problem.scene.TrainingViews();
  std::vector<std::filesystem::path> photos;
  for (const int view : training) {
    photos.push_back(std::filesystem::path(args.scene_folder) /
                     problem.scene.views[view].image_file);
  }
  NoCheckpoints none;
  NullObserver silent;
  const CancellationToken cancel;
  const RunControl run{pool, none, silent, cancel};
  const auto encoder = Encoder::Embedded();
  const auto features = CollectViewFeatures(*encoder, *encoder, photos, "", run);
  const NearestDistances distances =
      FindNearestDistances(features, std::vector<bool>(training.size(), true), run);
  const GaussianModel geometry =
      ParseGaussians(ReadFile(std::filesystem::path(args.run_folder) / artifact::kGeometry));
  const SeenSamples seen = SeenByGeometry(
      problem.scene, training, geometry, GridFor(static_cast<int>(training.size())), pool, cancel);
  const auto place = [&](int view) {
    return static_cast<int>(std::find(training.begin(), training.end(), view) - training.begin());
  };
  std::vector<double> errors;
  for (const int candidate : problem.candidates) {
    errors.push_back(ExpectedError(seen, distances, {place(problem.key), place(candidate)}));
  }
  errors.push_back(ExpectedError(seen, distances, {place(problem.key)}));
  return errors;
}

// Share of pairs of candidates ordered correctly by `worth` (more is better), among those with
// errors that differ by more than 1 %.
nlohmann::ordered_json Order(const std::vector<double>& errors, const std::vector<double>& worth) {
  int right = 0, pairs = 0;
  for (size_t i = 0; i < errors.size(); ++i) {
    for (size_t j = i + 1; j < errors.size(); ++j) {
      if (std::abs(errors[i] - errors[j]) < 0.01 * std::min(errors[i], errors[j])) continue;
      ++pairs;
      right += (errors[i] < errors[j]) == (worth[i] > worth[j]) ? 1 : 0;
    }
  }
  const size_t best = std::max_element(worth.begin(), worth.end()) - worth.begin();
  return {{"right", right}, {"pairs", pairs}, {"error_of_its_best", errors[best]}};
}

void Run(const Arguments& args) {
  const Problem problem = ReadProblem(args);
  LocalPipeline pipeline(args.scene_folder, args.out_folder, args.threads, 1, {});
  for (const char* name :
       {artifact::kScene, artifact::kKeyView, artifact::kKeyColor, artifact::kGeometry}) {
    pipeline.Take(name, std::filesystem::path(args.run_folder) / name);
  }
  ThreadPool pool(args.threads);
  ColorAll(args, problem, -1, &pipeline);
  const double alone = TrainingError(args, problem, pipeline);
  const std::vector<double> expected = ExpectedErrors(args, problem, pool);
  std::vector<double> errors, points, savings;
  nlohmann::ordered_json json{{"key_view", problem.scene.views[problem.key].name},
                              {"error_alone", alone},
                              {"expected_alone", expected.back()}};
  for (size_t k = 0; k < problem.candidates.size(); ++k) {
    const int candidate = problem.candidates[k];
    ColorAll(args, problem, candidate, &pipeline);
    errors.push_back(TrainingError(args, problem, pipeline));
    points.push_back(PointsGained(problem, candidate));
    savings.push_back(expected.back() - expected[k]);
    json["candidates"].push_back({{"view", problem.scene.views[candidate].name},
                                  {"error", errors.back()},
                                  {"saved", alone - errors.back()},
                                  {"points", points.back()},
                                  {"expected_error", expected[k]}});
    std::fprintf(stderr, "%s\n", json["candidates"].back().dump().c_str());
  }
  json["order_by_points"] = Order(errors, points);
  json["order_by_expected_error"] = Order(errors, savings);
  std::printf("%s\n", json.dump(1).c_str());
}

}  // namespace

void AddNextKeyCommand(CLI::App& app) {
  auto args = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("next-key", "Compare measured and expected errors of second key views");
  command
      ->add_option("--scene", args->scene_folder, "Folder of colour photos, with or without poses")
      ->required();
  command->add_option("--run", args->run_folder, "Output folder of a `pipeline` run")->required();
  command->add_option("--out", args->out_folder, "Folder for artifacts")->required();
  command->add_option("--candidates", args->candidates, "Number of candidates");
  command->add_option("--side", args->side_px, "Longer side of the working pictures, px");
  command->add_option("--iterations",
                      args->iterations,
                      "Iterations of personalization; 0: feature neighbours only");
  command->add_option("--threads", args->threads, "Number of threads");
  command->callback([args] { Run(*args); });
}

}  // namespace color3d
