// color3d-bench automatic: automatic colourization of photographs against their true colours.
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/encoder/embedded/embedded_weights.h"
#include "core/encoder/torch_threads.h"
#include "core/weights/weight_file.h"
#include "tests/bench/commands.h"
#include "tests/bench/keyview/automatic_scores.h"

namespace color3d {
namespace {

struct AutomaticArguments {
  std::string photos_folder;
  std::string weights_file;
  std::string out_folder;
  double temperature = 0.0;
  int count = 0;
  int max_side_px = 400;
  int threads = 2;
};

std::shared_ptr<const AutomaticColorizer> MakeColorizer(const AutomaticArguments& args) {
  if (args.weights_file.empty() && args.temperature == 0.0) return AutomaticColorizer::Embedded();
  WeightMap weights =
      args.weights_file.empty() ? EmbeddedWeights("") : ReadWeightFile(args.weights_file);
  if (!weights.contains("color_bins")) {
    return AutomaticColorizer::FromWeightFile(args.weights_file);
  }
  if (args.temperature > 0.0) {
    weights["color_temperature"] = {{1}, {static_cast<float>(args.temperature)}};
  }
  return AutomaticColorizer::FromPretrained(weights);
}

nlohmann::ordered_json Json(const AutomaticScore& score) {
  return {{"photo", score.photo},
          {"delta_e00", score.delta_e00},
          {"delta_e00_gray", score.delta_e00_gray},
          {"colorfulness", score.colorfulness},
          {"colorfulness_truth", score.true_colorfulness}};
}

void RunAutomatic(const AutomaticArguments& args) {
  SetTorchThreads(args.threads, /*blas_threads=*/1);
  const auto colorizer = MakeColorizer(args);
  std::vector<AutomaticScore> scores;
  nlohmann::ordered_json result{{"colorizer", colorizer->description()}};
  const auto start = std::chrono::steady_clock::now();
  for (const auto& photo : PhotosBelow(args.photos_folder, args.count)) {
    scores.push_back(ScoreAutomatic(*colorizer, photo, args.max_side_px, args.out_folder));
    result["photos"].push_back(Json(scores.back()));
  }
  result["mean"] = Json(MeanScore(scores));
  result["seconds_per_photo"] =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() /
      static_cast<double>(scores.size());
  std::printf("%s\n", result.dump(1).c_str());
}

}  // namespace

void AddAutomaticCommand(CLI::App& app) {
  auto args = std::make_shared<AutomaticArguments>();
  CLI::App* command = app.add_subcommand(
      "automatic", "Colour photographs automatically and score them against the truth");
  command->add_option("--photos", args->photos_folder, "Folder of colour photographs")->required();
  command->add_option(
      "--weights", args->weights_file, "Weights of `pretrain` or DDColor; default: embedded");
  command->add_option(
      "--out", args->out_folder, "Folder for PNGs of grey, coloured and true side by side");
  command
      ->add_option("--temperature",
                   args->temperature,
                   "Temperature of the colour distribution; default: stored in the weights")
      ->check(CLI::Range(0.05, 2.0));
  command->add_option(
      "--count", args->count, "Maximum number of photographs, evenly spaced; 0: all");
  command->add_option("--side", args->max_side_px, "Longer side of the pictures, px")
      ->check(CLI::Range(16, 8192));
  command->add_option("--threads", args->threads, "Number of threads")->check(CLI::Range(1, 256));
  command->callback([args] { RunAutomatic(*args); });
}

}  // namespace color3d
