// color3d-bench make-weights: writes random weights in a published layout.
#include <cstdio>
#include <memory>
#include <string>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/weights/safetensors.h"
#include "tests/bench/commands.h"
#include "tests/support/networks/random_features.h"
#include "tests/support/networks/synthetic_networks.h"

namespace color3d {
namespace {

struct MakeWeightsArguments {
  std::string file;
  std::string kind = "ddcolor-tiny";
  bool half = false;
  uint64_t seed = 1;
};

WeightMap Make(const MakeWeightsArguments& args) {
  if (args.kind == "ddcolor-tiny") return SyntheticDdcolorWeights({}, args.seed);
  if (args.kind == "ddcolor-mini") {
    return SyntheticDdcolorWeights(SyntheticDdcolor::Mini(), args.seed);
  }
  if (args.kind == "encoder") {
    WeightMap weights;
    for (auto& [name, array] : RandomFeatureWeights(ConvNextConfig(), args.seed)) {
      weights["encoder." + name] = array;
    }
    return weights;
  }
  if (args.kind == "clip-mini") return SyntheticClipWeights({}, args.seed);
  SyntheticClip base;  // ViT-B/32
  base.width = 768;
  base.layers = 12;
  base.patch_px = 32;
  base.grid = 7;
  base.embedding = 512;
  base.text_width = 512;
  base.vocabulary = 49408;
  return SyntheticClipWeights(base, args.seed);
}

void RunMakeWeights(const MakeWeightsArguments& args) {
  const WeightMap weights = Make(args);
  size_t values = 0;
  for (const auto& [name, array] : weights) values += array.values.size();
  const std::string bytes = SerializeSafetensors(
      weights, args.half, {{"origin", "seeded random numbers in the layout of " + args.kind}});
  WriteFileAtomic(args.file, bytes);
  std::printf("%s: %zu arrays, %zu values, %zu bytes\n",
              args.file.c_str(),
              weights.size(),
              values,
              bytes.size());
}

}  // namespace

void AddMakeWeightsCommand(CLI::App& app) {
  auto args = std::make_shared<MakeWeightsArguments>();
  CLI::App* command = app.add_subcommand(
      "make-weights", "Write a safetensors file with random weights in a published layout");
  command->add_option("file", args->file, "File to write")->required();
  command->add_option("--kind", args->kind, "Network")
      ->check(CLI::IsMember({"ddcolor-tiny", "ddcolor-mini", "clip-b32", "clip-mini", "encoder"}));
  command->add_flag("--half", args->half, "Write float16");
  command->add_option("--seed", args->seed, "Seed");
  command->callback([args] { RunMakeWeights(*args); });
}

}  // namespace color3d
