// color3d-bench networks: time and memory to load a published network, and time per picture.
#include <ATen/Parallel.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "core/base/memory.h"
#include "core/encoder/encoder.h"
#include "core/keycolor/automatic/automatic.h"
#include "core/keycolor/automatic/ddcolor.h"
#include "tests/bench/commands.h"
#include "tests/bench/result_file.h"
#include "tests/support/networks/synthetic_networks.h"

namespace color3d {
namespace {

struct NetworksArguments {
  std::string weights_file;
  std::string json_file;
  std::string as = "auto";
  int width = 1008;
  int height = 756;
  int threads = 1;
};

template <typename Body>
double SecondsOf(Body&& body) {
  const auto start = std::chrono::steady_clock::now();
  body();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void RunNetworks(const NetworksArguments& args) {
  at::set_num_threads(args.threads);
  Image luminance(args.width, args.height, 1);
  for (int y = 0; y < args.height; ++y) {
    for (int x = 0; x < args.width; ++x) {
      luminance.At(0, y, x) = 50.0f + 30.0f * std::sin(0.05f * x) * std::cos(0.03f * y);
    }
  }
  // Runs a small network first, so that memory of the libraries is not counted.
  Ddcolor(SyntheticDdcolorWeights(SyntheticDdcolor::Mini(), 1)).Colorize(Image(8, 8, 1, 50.0f));
  const int64_t before = ResidentMemoryBytes();
  nlohmann::ordered_json result{{"weights", args.weights_file}, {"threads", args.threads}};
  const auto loaded = [&](double seconds, const std::string& description) {
    result["description"] = description;
    result["load_seconds"] = seconds;
    result["peak_bytes_above_start"] = PeakMemoryBytes() - before;
    result["bytes_kept"] = ResidentMemoryBytes() - before;
  };
  if (args.as == "auto") {
    std::shared_ptr<const AutomaticColorizer> network;
    const double seconds =
        SecondsOf([&] { network = AutomaticColorizer::FromWeightFile(args.weights_file); });
    loaded(seconds, network->description());
    for (const char* run : {"first_picture_seconds", "next_picture_seconds"}) {
      result[run] = SecondsOf([&] { network->Colorize(luminance); });
    }
  } else {
    std::shared_ptr<const Encoder> network;
    const double seconds = SecondsOf([&] { network = Encoder::FromWeightFile(args.weights_file); });
    loaded(seconds, network->description());
    result["describe_seconds"] = SecondsOf([&] { network->Describe(luminance); });
    result["deep_features_seconds"] = SecondsOf([&] { network->DeepFeatures(luminance); });
  }
  result["peak_bytes_with_pictures"] = PeakMemoryBytes() - before;
  WriteResult(result, args.json_file);
}

}  // namespace

void AddNetworksCommand(CLI::App& app) {
  auto args = std::make_shared<NetworksArguments>();
  CLI::App* command =
      app.add_subcommand("networks", "Measure time and memory of a published network");
  command->add_option("--weights", args->weights_file, "Weight file")->required();
  command->add_option("--as", args->as, "Use of the network: automatic colourizer or encoder")
      ->check(CLI::IsMember({"auto", "encoder"}));
  command->add_option("--width", args->width, "Width of the picture, px")
      ->check(CLI::Range(1, 10000));
  command->add_option("--height", args->height, "Height of the picture, px")
      ->check(CLI::Range(1, 10000));
  command->add_option("--threads", args->threads, "Number of threads")->check(CLI::Range(1, 1024));
  command->add_option(
      "--json", args->json_file, "File for the result (JSON); default: standard output");
  command->callback([args] { RunNetworks(*args); });
}

}  // namespace color3d
