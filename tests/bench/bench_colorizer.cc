// color3d-bench colorizer: personalization on one key view, colour error on every eighth view.
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/colorizer/colorizer.h"
#include "core/image/codec.h"
#include "core/image/probe.h"
#include "core/report/curves.h"
#include "tests/bench/bench_encoder.h"
#include "tests/bench/commands.h"

namespace color3d {
namespace {

struct ColorizerArguments {
  std::string photos_folder;
  std::string key;
  std::string out_folder;
  int side_px = 400;
  bool paper = false;
  std::string encoder = "embedded";
  ColorizerOptions options;
};

void RunColorizer(const ColorizerArguments& args) {
  std::vector<std::string> photos;
  for (const std::string& name : ListFiles(args.photos_folder)) {
    if (HasImageExtension(name)) photos.push_back(name);
  }
  if (photos.size() < 2) throw InvalidArgument(args.photos_folder + " holds fewer than 2 photos");
  const std::string key = args.key.empty() ? photos[photos.size() / 2] : args.key;
  const auto load = [&](const std::string& name) {
    return FitWithin(LabFromSrgb(ReadImage(std::filesystem::path(args.photos_folder) / name)),
                     args.side_px);
  };
  NullObserver silent;
  NoCheckpoints none;
  CancellationToken cancel;
  CurveRecorder recorder("personalize", silent, none);
  const Image key_lab = load(key);
  ColorizerOptions options = args.options;
  if (args.paper) options.recipe = ColorizerOptions::Recipe::kPaper;
  const auto colorizer = TrainColorizer(BenchEncoder(args.encoder),
                                        {{key, LuminanceOfLab(key_lab), ChromaOfLab(key_lab)}},
                                        options,
                                        recorder,
                                        recorder,
                                        cancel);
  nlohmann::ordered_json result{{"key", key}, {"seconds_training", recorder.Seconds()}};
  double error = 0.0;
  double grey_error = 0.0;
  double seconds = 0.0;
  int count = 0;
  for (size_t i = 0; i < photos.size(); i += 8) {
    if (photos[i] == key) continue;
    const Image truth = load(photos[i]);
    const Image luminance = LuminanceOfLab(truth);
    const auto start = std::chrono::steady_clock::now();
    const Image predicted = JoinLab(luminance, colorizer->Colorize(luminance));
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    error += MeanDeltaE00(predicted, truth);
    grey_error += MeanDeltaE00(JoinLab(luminance, Image(truth.width, truth.height, 2)), truth);
    ++count;
    if (!args.out_folder.empty()) {
      std::filesystem::create_directories(args.out_folder);
      WriteFileAtomic(std::filesystem::path(args.out_folder) / (std::to_string(i) + ".png"),
                      EncodePng8(SrgbFromLab(predicted)));
    }
  }
  result["views"] = count;
  result["delta_e00_chroma_2d"] = error / count;
  result["delta_e00_grey"] = grey_error / count;
  result["seconds_per_view"] = seconds / count;
  result["colorizer_bytes"] = colorizer->Serialize().size();
  for (const CurvePoint& p : recorder.points()) {
    result["curve"].push_back({{"seconds", p.seconds},
                               {"iteration", p.iteration},
                               {"error_name", p.error_name},
                               {"value", p.value}});
  }
  std::printf("%s\n", result.dump(1).c_str());
}

}  // namespace

void AddColorizerCommand(CLI::App& app) {
  auto args = std::make_shared<ColorizerArguments>();
  CLI::App* command = app.add_subcommand(
      "colorizer", "personalize on one photo of a colour folder, score on every eighth one");
  command->add_option("--photos", args->photos_folder)->required();
  command->add_option("--key", args->key, "file name; default: the middle one");
  command->add_option("--out", args->out_folder, "where coloured views are written");
  command->add_option("--side", args->side_px, "px");
  command->add_option("--iterations", args->options.iterations);
  command->add_option("--time-limit", args->options.time_limit_seconds, "seconds");
  command->add_option("--threads", args->options.threads);
  command
      ->add_option(
          "--encoder", args->encoder, "embedded, random, squeezenet=FILE.onnx, or a weight file")
      ->capture_default_str();
  command->add_flag("--paper", args->paper, "the paper's recipe");
  command->callback([args] { RunColorizer(*args); });
}

}  // namespace color3d
