// color3d-bench reference: error of a key view coloured from reference pictures.
#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/encoder/encoder.h"
#include "core/image/codec.h"
#include "core/keycolor/references/reference.h"
#include "tests/bench/commands.h"
#include "tests/bench/result_file.h"

namespace color3d {
namespace {

struct ReferenceArguments {
  std::string key;
  std::vector<std::string> references;
  std::string picture_file;
  std::string json_file;
  int max_side_px = 800;
  int threads = 0;
  ReferenceOptions options;
};

void RunReference(const ReferenceArguments& args) {
  const Image truth = LabFromSrgb(FitWithin(ReadImage(args.key), args.max_side_px));
  Image luminance(truth.width, truth.height, 1);
  std::copy_n(truth.data.begin(), luminance.data.size(), luminance.data.begin());
  std::vector<Image> references;
  for (const std::string& file : args.references) references.push_back(ReadImage(file));
  ThreadPool pool(args.threads);
  NoCheckpoints none;
  NullObserver ignore;
  const auto start = std::chrono::steady_clock::now();
  const ReferenceSolution solution = KeyColorFromReferences(
      luminance, references, *Encoder::Embedded(), args.options, {pool, none, ignore, {}});
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  const Image colored = JoinLab(luminance, solution.ab);
  const Image gray = JoinLab(luminance, Image(truth.width, truth.height, 2));
  WriteResult({{"key", args.key},
               {"references", args.references},
               {"encoder", Encoder::Embedded()->description()},
               {"seconds", seconds.count()},
               {"mean_confidence", solution.mean_confidence},
               {"explained", solution.explained},
               {"delta_e00", MeanDeltaE00(colored, truth)},
               {"delta_e00_of_gray", MeanDeltaE00(gray, truth)}},
              args.json_file);
  if (args.picture_file.empty()) return;
  WriteFileAtomic(args.picture_file, EncodePng8(SrgbFromLab(colored)));
}

}  // namespace

void AddReferenceCommand(CLI::App& app) {
  auto args = std::make_shared<ReferenceArguments>();
  CLI::App* command =
      app.add_subcommand("reference", "Colour a picture from reference pictures and score it");
  command->add_option("key", args->key, "Colour photo to be coloured from its L")->required();
  command->add_option("references", args->references, "Reference pictures in colour")->required();
  command->add_option("--max-side", args->max_side_px, "Longer side of the coloured picture, px");
  command->add_option(
      "--match-weight", args->options.match_weight, "Weight of a match (ReferenceOptions)");
  command->add_option(
      "--match-side", args->options.match_side_px, "Longer side at which pictures are matched, px");
  command->add_option("--threads", args->threads, "Number of threads; 0: one per core");
  command->add_option("--picture", args->picture_file, "PNG file for the result");
  command->add_option(
      "--json", args->json_file, "File for the result (JSON); default: standard output");
  command->callback([args] { RunReference(*args); });
}

}  // namespace color3d
