// color3d-bench exemplar: trains the head of the feed-forward colorizer (exemplar_head.h) on pairs
// of parts of colour photographs: one is the key view, the other one is to be coloured.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>

#include "core/base/files.h"
#include "core/colorizer/exemplar/exemplar_head.h"
#include "core/colorizer/neighbors/known_cells.h"
#include "core/colorizer/training/adam.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/torch_threads.h"
#include "core/weights/safetensors.h"
#include "tests/bench/commands.h"
#include "tests/bench/pretrain/photo_set.h"

namespace color3d {
namespace {

struct Arguments {
  std::vector<std::string> photos;
  std::string validate_folder, out_file;
  int pairs = 600, validation_pairs = 60, passes = 12;
  int size_px = 192;
  double learning_rate = 2e-3;
  int threads = 1;
  uint64_t seed = 1;
};

// A picture to colour, what its neighbours in the key view answer, and the truth.
struct Sample {
  std::vector<torch::Tensor> taps;
  torch::Tensor luminance;
  NeighborColors found;
  torch::Tensor truth;  // [2,h,w], relative chroma
  torch::Tensor scale;  // [1,h,w], of relative chroma to Lab units
};

double Seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

torch::Tensor CellMap(const Image& image, int64_t rows, int64_t columns) {
  return CellMeans(TensorFromImage(image)).t().reshape({-1, rows, columns}).contiguous();
}

Sample MakeSample(const TrainingPair& pair, const TapEncoder& encoder, Random& random) {
  const TrainingPicture key{"the key view", pair.first.luminance, pair.first.ab};
  FeatureNeighborsOptions options;
  options.relative_chroma = FitRelativeChroma(key.luminance, key.ab);
  const FeatureNeighbors neighbors(
      encoder, std::span(&key, 1), options, Random(random.NextUint32(), 0), CancellationToken());
  Sample sample;
  const Image& l = pair.second.luminance;
  sample.luminance = TensorFromImage(l);
  sample.taps = encoder.Taps(encoder.Input(sample.luminance));
  sample.found = neighbors.Lookup(sample.taps, sample.luminance);
  sample.taps[0] = sample.taps[1] = torch::Tensor();  // large, and not used
  sample.taps.resize(4);
  const int64_t rows = sample.found.ab.size(1), columns = sample.found.ab.size(2);
  sample.truth = CellMap(ToRelative(options.relative_chroma, l, pair.second.ab), rows, columns);
  sample.scale = CellMap(
      FromRelative(options.relative_chroma, l, Image(l.width, l.height, 2, 1.0f)), rows, columns);
  return sample;
}

std::vector<Sample> MakeSamples(const std::vector<std::string>& folders,
                                const Arguments& args,
                                int count,
                                Random random) {
  torch::NoGradGuard no_grad;
  std::vector<PhotoFolder> parts;
  for (const std::string& folder : folders) parts.push_back({folder, 1.0});
  const PhotoSet photos(parts);
  const auto encoder = std::dynamic_pointer_cast<const TapEncoder>(Encoder::Embedded());
  std::vector<Sample> samples;
  while (static_cast<int>(samples.size()) < count) {
    samples.push_back(MakeSample(photos.Pair(args.size_px, random), *encoder, random));
  }
  return samples;
}

// Mean difference of chroma over the cells, Lab units.
torch::Tensor Loss(const Sample& sample, const torch::Tensor& ab) {
  const torch::Tensor difference = (ab - sample.truth) * sample.scale;
  return (difference.square().sum(0) + 1.0).sqrt().mean();
}

double MeanLoss(const std::vector<Sample>& samples, const ExemplarHead* head) {
  torch::NoGradGuard no_grad;
  double sum = 0.0;
  for (const Sample& sample : samples) {
    const torch::Tensor ab = head != nullptr
                                 ? head->Refine(sample.taps, sample.luminance, sample.found)
                                 : sample.found.ab;
    sum += Loss(sample, ab).item<double>();
  }
  return sum / static_cast<double>(samples.size());
}

void Run(const Arguments& args) {
  SetTorchThreads(args.threads, /*blas_threads=*/1);
  const double start = Seconds();
  const std::vector<Sample> training =
      MakeSamples(args.photos, args, args.pairs, Random(args.seed, 1));
  const std::vector<Sample> validation =
      MakeSamples({args.validate_folder}, args, args.validation_pairs, Random(args.seed, 2));
  std::fprintf(stderr, "pairs made after %.0f s\n", Seconds() - start);
  Random random(args.seed, 3);
  const auto encoder = std::dynamic_pointer_cast<const TapEncoder>(Encoder::Embedded());
  ExemplarHead head(encoder->config(), random);
  for (const auto& [name, tensor] : head.parameters()) tensor.set_requires_grad(true);
  Adam adam(head.parameters());
  const double neighbors = MeanLoss(validation, nullptr);
  auto curve = nlohmann::ordered_json::array();
  WeightMap best;
  double best_loss = neighbors;
  const int64_t total = int64_t{args.passes} * args.pairs;
  for (int64_t step = 0; step < total; ++step) {
    const Sample& sample = training[random.NextBelow(static_cast<uint32_t>(training.size()))];
    Loss(sample, head.Refine(sample.taps, sample.luminance, sample.found)).backward();
    const double progress = static_cast<double>(step) / static_cast<double>(total);
    adam.Step(args.learning_rate * 0.5 * (1.0 + std::cos(M_PI * progress)), 1.0);
    if ((step + 1) % args.pairs != 0) continue;
    const double loss = MeanLoss(validation, &head);
    curve.push_back({{"step", step + 1}, {"seconds", Seconds() - start}, {"loss", loss}});
    std::fprintf(stderr, "step %ld: %.3f (neighbours %.3f)\n", step + 1, loss, neighbors);
    if (loss >= best_loss) continue;
    best_loss = loss;
    best = head.Weights();
  }
  const nlohmann::ordered_json result{
      {"neighbors", neighbors}, {"head", best_loss}, {"curve", curve}};
  std::printf("%s\n", result.dump().c_str());
  if (!best.empty()) {
    WriteFileAtomic(args.out_file, SerializeSafetensors(best, true, {{"curve", result.dump()}}));
  }
}

}  // namespace

void AddExemplarCommand(CLI::App& app) {
  auto args = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "exemplar", "Train the head of the feed-forward colorizer on colour photographs");
  command->add_option("--photos", args->photos, "Folder of photographs; may be repeated")
      ->required();
  command->add_option("--validate", args->validate_folder, "Folder of photographs for validation")
      ->required();
  command->add_option("-o,--out", args->out_file, "File for the weights (safetensors)")->required();
  command->add_option("--pairs", args->pairs, "Number of pairs to train on")
      ->check(CLI::Range(1, 100000));
  command
      ->add_option("--validation-pairs", args->validation_pairs, "Number of pairs to validate on")
      ->check(CLI::Range(1, 100000));
  command->add_option("--passes", args->passes, "Passes over the pairs")
      ->check(CLI::Range(1, 10000));
  command->add_option("--size", args->size_px, "Side of the parts, px; a multiple of 32")
      ->check(CLI::Range(64, 512));
  command->add_option("--learning-rate", args->learning_rate, "Learning rate at the start");
  command->add_option("--threads", args->threads, "Number of threads")->check(CLI::Range(1, 256));
  command->add_option("--seed", args->seed, "Seed");
  command->callback([args] { Run(*args); });
}

}  // namespace color3d
