// color3d-bench weights: time and peak memory of loading a given weight file, or synthetic ones of
// the size of DDColor-tiny in every format.
#include <fmt/core.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/weights/weight_file.h"
#include "tests/bench/commands.h"
#include "tests/bench/result_file.h"
#include "tests/support/networks/weight_files.h"

namespace color3d {
namespace {

struct WeightsOptions {
  std::string file;
  std::string json_file;
};

struct LoadFigures {
  double seconds = 0.0;
  int64_t peak_bytes = 0;   // above the memory before loading
  int64_t array_bytes = 0;  // size of the arrays as float32
  int64_t arrays = 0;
};

// Loads in a child process, so that one file's peak does not hide the next one's.
LoadFigures MeasureLoad(const std::filesystem::path& path) {
  int ends[2];
  if (pipe(ends) != 0) throw Error(ErrorCode::kInternal, "cannot make a pipe");
  const pid_t child = fork();
  if (child < 0) throw Error(ErrorCode::kResourceExhausted, "cannot start a process");
  if (child == 0) {
    LoadFigures figures;
    try {
      const int64_t before = ResidentMemoryBytes();
      const auto start = std::chrono::steady_clock::now();
      const WeightMap weights = ReadWeightFile(path);
      figures.seconds =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      figures.peak_bytes = PeakMemoryBytes() - before;
      figures.arrays = static_cast<int64_t>(weights.size());
      for (const auto& [name, array] : weights) {
        figures.array_bytes += static_cast<int64_t>(array.values.size() * sizeof(float));
      }
    } catch (const Error& error) {
      std::fprintf(stderr, "color3d-bench: %s\n", error.what());
      _exit(1);
    }
    _exit(write(ends[1], &figures, sizeof(figures)) == sizeof(figures) ? 0 : 1);
  }
  close(ends[1]);
  LoadFigures figures;
  const bool received = read(ends[0], &figures, sizeof(figures)) == sizeof(figures);
  close(ends[0]);
  waitpid(child, nullptr, 0);
  if (!received) throw InvalidArgument("the weight file {} was not loaded", path.string());
  return figures;
}

nlohmann::ordered_json Report(const std::string& name, const std::filesystem::path& path) {
  const LoadFigures figures = MeasureLoad(path);
  return {{"file", name},
          {"file_bytes", std::filesystem::file_size(path)},
          {"arrays", figures.arrays},
          {"array_bytes", figures.array_bytes},
          {"seconds", figures.seconds},
          {"peak_bytes", figures.peak_bytes},
          {"peak_per_array_byte",
           static_cast<double>(figures.peak_bytes) / static_cast<double>(figures.array_bytes)}};
}

// As many arrays (440) and numbers (55 051 016) as the published DDColor-tiny, in sizes from single
// numbers to the largest matrices.
WeightMap DdcolorSizedWeights() {
  constexpr int kArrays = 440;
  constexpr int64_t kNumbers = 55'051'016;
  constexpr int64_t kSmall[] = {1, 96, 384, 768, 2048, 36864, 147456, 589824};
  WeightMap weights;
  Random random(/*seed=*/1);
  int64_t left = kNumbers;
  for (int i = 0; i < kArrays; ++i) {
    const int64_t size =
        i + 1 == kArrays ? left : kSmall[static_cast<size_t>(i) % std::size(kSmall)];
    WeightArray& array = weights[fmt::format("decoder.layers.{}.weight", i)];
    array.shape = {size};
    array.values.resize(static_cast<size_t>(size));
    for (float& value : array.values) value = static_cast<float>(random.NextUniform(-1.0, 1.0));
    left -= size;
  }
  return weights;
}

// Writes them in a child process, since memory of this process counts in all measurements.
void MakeFiles(const std::filesystem::path& folder) {
  const pid_t child = fork();
  if (child < 0) throw Error(ErrorCode::kResourceExhausted, "cannot start a process");
  if (child > 0) {
    int status = 0;
    waitpid(child, &status, 0);
    if (status != 0) throw Error(ErrorCode::kInternal, "the weight files could not be written");
    return;
  }
  try {
    const WeightMap weights = DdcolorSizedWeights();
    WriteFileAtomic(folder / "f32.safetensors", SerializeSafetensors(weights, false));
    WriteFileAtomic(folder / "f16.safetensors", SerializeSafetensors(weights, true));
    WriteFileAtomic(folder / "f32.pth", MakeStateDict(weights, {"params"}));
    WriteFileAtomic(folder / "f16.bin", MakeStateDict(weights, {"", "HalfStorage"}));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "color3d-bench: %s\n", error.what());
    _exit(1);
  }
  _exit(0);
}

void RunWeights(const WeightsOptions& options) {
  nlohmann::ordered_json result = nlohmann::ordered_json::array();
  if (!options.file.empty()) {
    result.push_back(Report(options.file, options.file));
  } else {
    const ScratchFolder folder;
    MakeFiles(folder.path());
    for (const char* name : {"f32.safetensors", "f16.safetensors", "f32.pth", "f16.bin"}) {
      result.push_back(Report(name, folder.path() / name));
    }
  }
  WriteResult(result, options.json_file);
}

}  // namespace

void AddWeightsCommand(CLI::App& app) {
  auto options = std::make_shared<WeightsOptions>();
  CLI::App* command = app.add_subcommand(
      "weights",
      "Measure time and peak memory of loading a weight file (default: synthetic ones of the size "
      "of DDColor-tiny, safetensors and PyTorch, single and half precision)");
  command->add_option("--file", options->file, "Weight file");
  command->add_option(
      "--json", options->json_file, "File for the result (JSON); default: standard output");
  command->callback([options] { RunWeights(*options); });
}

}  // namespace color3d
