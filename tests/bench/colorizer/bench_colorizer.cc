// color3d-bench colorizer: personalizes on one key view and scores every eighth view.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "core/base/files.h"
#include "core/base/memory.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/colorizer/personal/train_colorizer.h"
#include "core/colorizer/scene_batch.h"
#include "core/image/codec.h"
#include "core/image/probe/probe.h"
#include "core/report/curves.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/training_pictures.h"
#include "tests/bench/colorizer/bench_encoder.h"
#include "tests/bench/colorizer/colorizer_memory.h"
#include "tests/bench/commands.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct ColorizerArguments {
  std::string photos_folder;
  std::vector<std::string> all_in_one;
  std::string key;
  std::optional<int> crop_px;  // unset: the recipe's
  std::string out_folder;
  std::string json_file;
  int side_px = 400;
  int threads = 0;  // 0: one per core
  bool paper = false;
  bool one_after_another = true;
  bool memory = false;
  std::string encoder = "embedded";
  std::string precision = "auto";
  std::string pictures_folder;
  std::string kinds;
  double picture_share = kGeneratedShare;
  ColorizerOptions options{.iterations = 800};
};

// A folder of colour photos. The key view is the middle one or `key`.
struct Photos {
  Photos(const fs::path& photos_folder, const std::string& wanted_key, int side)
      : folder(photos_folder), side_px(side) {
    for (const std::string& name : ListFiles(folder)) {
      if (HasImageExtension(name)) names.push_back(name);
    }
    if (names.size() < 2) throw InvalidArgument("{} holds fewer than 2 photos", folder.string());
    key = wanted_key.empty() ? names[names.size() / 2] : wanted_key;
  }
  Image Lab(const std::string& name) const {
    return FitWithin(LabFromSrgb(ReadImage(folder / name)), side_px);
  }
  TrainingPicture Key() const {
    const Image lab = Lab(key);
    return {key, LuminanceOfLab(lab), ChromaOfLab(lab)};
  }

  fs::path folder;
  int side_px;
  std::vector<std::string> names;
  std::string key;
};

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

ColorizerOptions OptionsFrom(const ColorizerArguments& args) {
  ColorizerOptions options = args.options;
  if (args.paper) options.UsePaperRecipe();
  if (args.crop_px) options.crop_px = *args.crop_px;
  if (args.precision == "float32") options.precision = ColorizerOptions::Precision::kFloat32;
  if (args.precision == "bfloat16") options.precision = ColorizerOptions::Precision::kBfloat16;
  return options;
}

// Computes errors over every eighth view and writes the coloured views.
void Score(const Photos& photos,
           const Colorizer& colorizer,
           const std::string& out_folder,
           Json* result) {
  double error = 0.0;
  double gray_error = 0.0;
  double seconds = 0.0;
  int count = 0;
  for (size_t i = 0; i < photos.names.size(); i += 8) {
    if (photos.names[i] == photos.key) continue;
    const Image truth = photos.Lab(photos.names[i]);
    const Image luminance = LuminanceOfLab(truth);
    const auto start = std::chrono::steady_clock::now();
    const Image predicted = JoinLab(luminance, colorizer.Colorize(luminance));
    seconds += SecondsSince(start);
    error += MeanDeltaE00(predicted, truth);
    gray_error += MeanDeltaE00(JoinLab(luminance, Image(truth.width, truth.height, 2)), truth);
    ++count;
    if (!out_folder.empty()) {
      fs::create_directories(out_folder);
      WriteFileAtomic(fs::path(out_folder) / (std::to_string(i) + ".png"),
                      EncodePng8(SrgbFromLab(predicted)));
    }
  }
  (*result)["views"] = count;
  (*result)["delta_e00_chroma_2d"] = error / count;
  (*result)["delta_e00_gray"] = gray_error / count;
  (*result)["seconds_per_view"] = seconds / count;
}

// Generated pictures of the requested kinds, as written by color3d-bench augmentations.
std::vector<TrainingPicture> MorePictures(const ColorizerArguments& args) {
  if (args.pictures_folder.empty()) return {};
  const fs::path folder = args.pictures_folder;
  auto facts = nlohmann::json::parse(ReadFile(folder / artifact::kAugmentationFacts));
  auto& samples = facts.at("samples");
  for (auto it = samples.begin(); it != samples.end();) {
    const bool wanted = args.kinds.empty() ||
                        args.kinds.find(it->at("kind").get<std::string>()) != std::string::npos;
    it = wanted ? it + 1 : samples.erase(it);
  }
  return TrainingPicturesFrom(
      facts.dump(),
      [&](const std::string& name) { return ReadFile(folder / name); },
      args.options.max_side_px,
      args.picture_share);
}

Json RunOne(const ColorizerArguments& args) {
  const Photos photos(args.photos_folder, args.key, args.side_px);
  NullObserver silent;
  NoCheckpoints none;
  CancellationToken cancel;
  CurveRecorder recorder("personalize", silent, none);
  std::vector<TrainingPicture> pictures = MorePictures(args);
  pictures.insert(pictures.begin(), photos.Key());
  ThreadPool pool(args.threads);
  const auto colorizer = TrainColorizer(
      BenchEncoder(args.encoder), pictures, OptionsFrom(args), {pool, recorder, recorder, cancel});
  Json result{{"key", photos.key}, {"seconds_training", recorder.Seconds()}};
  Score(photos, *colorizer, args.out_folder, &result);
  result["colorizer_bytes"] = colorizer->Serialize().size();
  for (const CurvePoint& p : recorder.points()) {
    result["curve"].push_back({{"seconds", p.seconds},
                               {"iteration", p.iteration},
                               {"error_name", p.error_name},
                               {"value", p.value}});
  }
  return result;
}

float LargestDifference(const Colorizer& x, const Colorizer& y, const Image& luminance) {
  const Image a = x.Colorize(luminance);
  const Image b = y.Colorize(luminance);
  float largest = 0.0f;
  for (size_t i = 0; i < a.data.size(); ++i) {
    largest = std::max(largest, std::abs(a.data[i] - b.data[i]));
  }
  return largest;
}

// Trains all scenes in one batch, then (unless disabled) one after another.
Json RunAllInOne(const ColorizerArguments& args) {
  const ColorizerOptions options = OptionsFrom(args);
  const auto encoder = BenchEncoder(args.encoder);
  std::vector<Photos> scenes;
  std::vector<TrainingPicture> keys;
  for (const std::string& folder : args.all_in_one) {
    scenes.emplace_back(folder, "", args.side_px);
    keys.push_back(scenes.back().Key());
  }
  const auto train = [&](size_t i, SceneBatch* batch) {
    ThreadPool pool(args.threads);
    NullObserver silent;
    NoCheckpoints none;
    const CancellationToken go_on;
    const RunControl control{pool, none, silent, go_on};
    return batch != nullptr
               ? TrainColorizer(
                     encoder, {keys[i]}, options, control, BatchPlace{*batch, std::to_string(i)})
               : TrainColorizer(encoder, {keys[i]}, options, control);
  };
  Json result{{"scenes", scenes.size()}};
  const int64_t before = ResidentMemoryBytes();
  auto start = std::chrono::steady_clock::now();
  std::vector<std::shared_ptr<const Colorizer>> alone;
  if (args.one_after_another) {
    ResetPeakMemory();
    for (size_t i = 0; i < scenes.size(); ++i) alone.push_back(train(i, nullptr));
    result["seconds_one_after_another"] = SecondsSince(start);
    result["mib_one_after_another"] = (PeakMemoryBytes() - before) >> 20;
  }
  ResetPeakMemory();
  SceneBatch batch(args.threads);
  std::vector<std::shared_ptr<const Colorizer>> together(scenes.size());
  start = std::chrono::steady_clock::now();
  std::vector<std::thread> threads;
  for (size_t i = 0; i < scenes.size(); ++i) {
    threads.emplace_back([&, i] { together[i] = train(i, &batch); });
  }
  for (std::thread& thread : threads) thread.join();
  result["seconds_all_in_one"] = SecondsSince(start);
  result["mib_before"] = before >> 20;
  result["mib_all_in_one"] = (PeakMemoryBytes() - before) >> 20;
  if (!alone.empty()) {
    result["throughput_ratio"] = result["seconds_one_after_another"].get<double>() /
                                 result["seconds_all_in_one"].get<double>();
    float largest = 0.0f;
    for (size_t i = 0; i < scenes.size(); ++i) {
      largest = std::max(largest, LargestDifference(*alone[i], *together[i], keys[i].luminance));
    }
    result["largest_difference_ab"] = largest;
  }
  for (size_t i = 0; i < scenes.size(); ++i) {
    Json scene{{"folder", args.all_in_one[i]}};
    Score(scenes[i], *together[i], "", &scene);
    result["each"].push_back(scene);
  }
  return result;
}

// Memory of a batch: the encoder and each scene.
Json RunMemory(const ColorizerArguments& args) {
  MemorySubject subject;
  subject.options = OptionsFrom(args);
  subject.threads = args.threads;
  for (const std::string& folder : args.all_in_one) {
    subject.keys.push_back(Photos(folder, "", args.side_px).Key());
  }
  const int64_t before = ResidentMemoryBytes();
  subject.encoder = BenchEncoder(args.encoder);
  const int64_t loaded = ResidentMemoryBytes();
  subject.encoder->DeepFeatures(subject.keys.front().luminance);
  Json result{{"mib_before", before >> 20},
              {"mib_encoder_loaded", (loaded - before) >> 20},
              {"mib_encoder_used", (ResidentMemoryBytes() - before) >> 20}};
  result.update(PeakMemoryBySceneCount(subject, before));
  result["bytes_of_one_scene"] = TensorBytes(subject);
  return result;
}

void RunColorizer(const ColorizerArguments& args) {
  ShareMallocArenas(args.threads > 0 ? args.threads : 2);  // as in the worker
  const Json result = args.all_in_one.empty() ? RunOne(args)
                      : args.memory           ? RunMemory(args)
                                              : RunAllInOne(args);
  if (args.json_file.empty()) {
    std::printf("%s\n", result.dump(1).c_str());
  } else {
    WriteFileAtomic(args.json_file, result.dump(1) + "\n");
  }
}

}  // namespace

void AddColorizerCommand(CLI::App& app) {
  auto args = std::make_shared<ColorizerArguments>();
  CLI::App* command = app.add_subcommand(
      "colorizer", "Personalize on one colour photo of a folder and score every eighth photo");
  auto* photos = command->add_option("--photos", args->photos_folder, "Folder of colour photos");
  command->add_option("--all-in-one", args->all_in_one, "Folders of photos, trained in one batch")
      ->excludes(photos);
  command->add_flag("!--no-one-after-another",
                    args->one_after_another,
                    "With --all-in-one: skip the comparison with one after another");
  command->add_flag("--memory",
                    args->memory,
                    "With --all-in-one: measure peak memory of 1, 2, 4, ... scenes, and its parts");
  command->add_option(
      "--json", args->json_file, "File for the result (JSON); default: standard output");
  command->add_option("--key", args->key, "File name of the key view; default: the middle one");
  command->add_option("--out", args->out_folder, "Folder for coloured views");
  command->add_option("--side", args->side_px, "Longer side of the working pictures, px");
  command->add_option("--iterations", args->options.iterations, "Iterations of personalization");
  command->add_option(
      "--time-limit", args->options.time_limit_seconds, "Time limit of personalization, s");
  command->add_option("--threads", args->threads, "Number of threads");
  command
      ->add_option("--encoder",
                   args->encoder,
                   "Encoder: embedded, random, squeezenet=FILE.onnx, or a weight file")
      ->capture_default_str();
  command->add_option(
      "--consistency", args->options.consistency_weight, "Weight of the consistency loss");
  command->add_option("--pictures",
                      args->pictures_folder,
                      "Output folder of `augmentations`: also train on its pictures");
  command->add_option(
      "--kinds", args->kinds, "Kinds of these pictures to use, e.g. outpaint,novel_view");
  command->add_option("--picture-share",
                      args->picture_share,
                      "Share of these pictures, relative to the key view's 1");
  command->add_option("--crop", args->crop_px, "Size of crops, px");
  command->add_option("--seed", args->options.seed, "Seed");
  command->add_option("--average-decay",
                      args->options.average_decay,
                      "Decay of the average of the parameters; 0: off");
  command->add_option("--min-improvement",
                      args->options.min_improvement,
                      "Minimum improvement to continue; 0: no early stop");
  command->add_option("--precision", args->precision, "Precision: auto, float32 or bfloat16")
      ->check(CLI::IsMember({"auto", "float32", "bfloat16"}))
      ->capture_default_str();
  command->add_flag("--paper", args->paper, "Use the paper's recipe");
  command->callback([args] {
    if (args->photos_folder.empty() && args->all_in_one.empty()) {
      throw CLI::RequiredError("--photos or --all-in-one");
    }
    RunColorizer(*args);
  });
}

}  // namespace color3d
