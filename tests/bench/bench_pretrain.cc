// color3d-bench pretrain: trains the embedded encoder and automatic colourizer, resumable.
#include <torch/cuda.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/encoder/torch_threads.h"
#include "core/keycolor/automatic/automatic.h"
#include "core/weights/safetensors.h"
#include "tests/bench/commands.h"
#include "tests/bench/keyview/automatic_scores.h"
#include "tests/bench/pretrain/pretrainer.h"

namespace color3d {
namespace {

struct PretrainArguments {
  std::vector<std::string> photos;
  std::vector<std::string> clips;
  std::string start_file;
  std::string device = "auto";
  std::string validate_folder;
  std::string teacher_file;
  std::string checkpoint_file;
  std::string out_file;
  int validate_every = 500;
  int validate_photos = 40;
  int max_side_px = 256;
  int threads = 2;
  double seconds = 0.0;
  double stop_after_seconds = 0.0;
  double temperature = 1.0;
  PretrainOptions options;
};

double Seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// "FOLDER" or "FOLDER=WEIGHT".
PhotoFolder ParseFolder(const std::string& text) {
  const size_t equals = text.rfind('=');
  if (equals == std::string::npos) return {text, 1.0};
  return {text.substr(0, equals), std::stod(text.substr(equals + 1))};
}

// Mean colour error and colourfulness over the validation photographs.
nlohmann::ordered_json Validate(const PretrainArguments& args, const WeightMap& weights) {
  const auto colorizer = AutomaticColorizer::FromPretrained(weights);
  std::vector<AutomaticScore> scores;
  for (const auto& photo : PhotosBelow(args.validate_folder, args.validate_photos)) {
    scores.push_back(ScoreAutomatic(*colorizer, photo, args.max_side_px));
  }
  const AutomaticScore mean = MeanScore(scores);
  return {{"photos", scores.size()},
          {"delta_e00", mean.delta_e00},
          {"delta_e00_gray", mean.delta_e00_gray},
          {"colorfulness", mean.colorfulness},
          {"colorfulness_truth", mean.true_colorfulness}};
}

std::vector<PhotoFolder> ParseFolders(const std::vector<std::string>& texts) {
  std::vector<PhotoFolder> folders;
  for (const std::string& text : texts) folders.push_back(ParseFolder(text));
  return folders;
}

torch::Device DeviceOf(const std::string& name) {
  const bool cuda = torch::cuda::is_available();
  if (name == "cuda" && !cuda) {
    throw Error(ErrorCode::kFailedPrecondition,
                "LibTorch has no CUDA device here; use --device cpu");
  }
  return name == "cpu" || !cuda ? torch::kCPU : torch::kCUDA;
}

PretrainLosses Sum(const PretrainLosses& x, const PretrainLosses& y) {
  return {x.color + y.color,
          x.distillation + y.distillation,
          x.copy + y.copy,
          x.contrast + y.contrast,
          x.logits + y.logits};
}

void RunPretrain(const PretrainArguments& args) {
  SetTorchThreads(args.threads, /*blas_threads=*/1);
  const PhotoSet photos(ParseFolders(args.photos), ParseFolders(args.clips));
  std::optional<SqueezeNet> teacher;
  if (!args.teacher_file.empty()) teacher.emplace(args.teacher_file);
  PretrainOptions options = args.options;
  options.device = DeviceOf(args.device);
  WeightMap start_weights;
  if (!args.start_file.empty()) start_weights = ParseSafetensors(ReadFile(args.start_file));
  Pretrainer trainer(
      options, photos, std::move(teacher), args.start_file.empty() ? nullptr : &start_weights);
  nlohmann::ordered_json notes{{"photos", photos.size()}, {"seconds", 0.0}};
  notes["curve"] = nlohmann::ordered_json::array();
  if (std::filesystem::exists(args.checkpoint_file)) {
    notes = nlohmann::ordered_json::parse(trainer.Restore(ReadFile(args.checkpoint_file)));
  }
  const double before = notes["seconds"].get<double>();
  const double start = Seconds();
  PretrainLosses sum;
  int averaged = 0;
  const auto save = [&] {
    notes["seconds"] = before + Seconds() - start;
    WriteFileAtomic(args.checkpoint_file, trainer.Checkpoint(notes.dump()));
    WeightMap weights = trainer.AveragedWeights();
    weights["color_temperature"] = {{1}, {static_cast<float>(args.temperature)}};
    const double count = std::max(1, averaged);
    nlohmann::ordered_json point{{"iteration", trainer.iteration()},
                                 {"seconds", notes["seconds"]},
                                 {"loss_color", sum.color / count},
                                 {"loss_distillation", sum.distillation / count},
                                 {"loss_logits", sum.logits / count}};
    if (options.copy_weight > 0.0) {
      point["loss_copy"] = sum.copy / count;
      point["loss_contrast"] = sum.contrast / count;
    }
    if (!args.validate_folder.empty()) point.update(Validate(args, weights));
    notes["curve"].push_back(point);
    std::printf("%s\n", point.dump().c_str());
    std::fflush(stdout);
    WriteFileAtomic(args.out_file,
                    SerializeSafetensors(weights, true, {{"curve", notes["curve"].dump()}}));
    sum = {};
    averaged = 0;
  };
  // Completed share of a schedule by time.
  const auto progress = [&]() -> std::optional<double> {
    if (args.seconds <= 0.0) return std::nullopt;
    return (before + Seconds() - start) / args.seconds;
  };
  while (progress().value_or(0.0) < 1.0 &&
         (args.seconds > 0.0 || trainer.iteration() < options.iterations)) {
    sum = Sum(sum, trainer.Step(progress()));
    ++averaged;
    if (trainer.iteration() % args.validate_every == 0) save();
    if (args.stop_after_seconds > 0.0 && Seconds() - start > args.stop_after_seconds) break;
  }
  if (averaged > 0) save();
}

}  // namespace

void AddPretrainCommand(CLI::App& app) {
  auto args = std::make_shared<PretrainArguments>();
  CLI::App* command = app.add_subcommand(
      "pretrain", "Train the embedded encoder and automatic colourizer on colour photographs");
  command
      ->add_option(
          "--photos", args->photos, "Folder of photographs: FOLDER[=WEIGHT]; may be repeated")
      ->required();
  command->add_option(
      "--clips", args->clips, "Folder of folders of frames: FOLDER[=WEIGHT]; may be repeated");
  command->add_option("--start", args->start_file, "Initial weights; default: random");
  command->add_option("--validate", args->validate_folder, "Folder of photographs for validation");
  command->add_option("--validate-every", args->validate_every, "Iterations between validations")
      ->check(CLI::Range(1, 1000000));
  command
      ->add_option(
          "--validate-photos", args->validate_photos, "Number of photographs to validate with")
      ->check(CLI::Range(1, 100000));
  command->add_option("--teacher", args->teacher_file, "SqueezeNet 1.1 (ONNX) to distil from");
  command
      ->add_option("--checkpoint",
                   args->checkpoint_file,
                   "Checkpoint file; training resumes from it if it exists")
      ->required();
  command
      ->add_option("-o,--out", args->out_file, "File for the weights (safetensors, half precision)")
      ->required();
  command->add_option("--iterations", args->options.iterations, "Number of iterations")
      ->check(CLI::Range(1, 100000000));
  command
      ->add_option(
          "--seconds", args->seconds, "Duration of the whole training, s, instead of --iterations")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--copy-weight",
                   args->options.copy_weight,
                   "Weight of the loss of copied colours; 0: off")
      ->check(CLI::Range(0.0, 100.0));
  command
      ->add_option("--contrast-weight",
                   args->options.contrast_weight,
                   "Weight of the contrast between cells")
      ->check(CLI::Range(0.0, 100.0));
  command
      ->add_option(
          "--distillation-weight", args->options.distillation_weight, "Weight of distillation")
      ->check(CLI::Range(0.0, 100.0));
  command
      ->add_option(
          "--rebalancing", args->options.rebalancing_power, "Rebalancing of rare colours, 0 to 1")
      ->check(CLI::Range(0.0, 1.0));
  command
      ->add_option("--prior",
                   args->options.prior_share,
                   "Share of the rebalancing that inference undoes, 0 to 1")
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--seed", args->options.seed, "Seed");
  command->add_option("--device", args->device, "Device; auto: a GPU if LibTorch has one")
      ->check(CLI::IsMember({"auto", "cpu", "cuda"}));
  command->add_flag(
      "--half", args->options.half_precision, "Run the networks in bfloat16 on the CPU");
  command->add_option("--batch", args->options.batch, "Pictures per batch")
      ->check(CLI::Range(1, 4096));
  command->add_option("--size", args->options.size_px, "Size of crops in the first half, px")
      ->check(CLI::Range(64, 512));
  command
      ->add_option(
          "--late-size", args->options.late_size_px, "Size of crops in the second half, px")
      ->check(CLI::Range(64, 512));
  command->add_option("--learning-rate", args->options.learning_rate, "Maximum learning rate")
      ->check(CLI::Range(1e-6, 1.0));
  command
      ->add_option(
          "--temperature", args->temperature, "Temperature of the colour distribution to store")
      ->check(CLI::Range(0.05, 2.0));
  command->add_option("--threads", args->threads, "Number of threads")->check(CLI::Range(1, 256));
  command->add_option(
      "--stop-after", args->stop_after_seconds, "Stop after these seconds, to be resumed later");
  command->callback([args] { RunPretrain(*args); });
}

}  // namespace color3d
