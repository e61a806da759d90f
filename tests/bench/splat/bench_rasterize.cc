// color3d-bench rasterize: growth of the cost of a training iteration on synthetic loads.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "core/simd/instruction_set.h"
#include "tests/bench/commands.h"
#include "tests/bench/result_file.h"
#include "tests/bench/splat/synthetic_splats.h"

namespace color3d {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

struct RasterizeArguments {
  bool quick = false;
  int repeats = 5;
  std::string json_file;
};

constexpr std::array kPhases = {
    "project", "bin", "forward", "loss", "backward", "project_backward", "adam"};
using Times = std::array<double, kPhases.size()>;  // ms

Times OneIteration(SyntheticIteration& iteration) {
  using Step = void (SyntheticIteration::*)();
  constexpr Step kSteps[] = {&SyntheticIteration::Project,
                             &SyntheticIteration::Bin,
                             &SyntheticIteration::Forward,
                             &SyntheticIteration::Loss,
                             &SyntheticIteration::Backward,
                             &SyntheticIteration::ProjectBackward,
                             &SyntheticIteration::Adam};
  Times ms{};
  for (size_t k = 0; k < kPhases.size(); ++k) {
    const Clock::time_point start = Clock::now();
    (iteration.*kSteps[k])();
    ms[k] = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  }
  return ms;
}

// The median of each phase.
Times Medians(SyntheticIteration& iteration, int repeats) {
  OneIteration(iteration);  // allocates
  std::vector<Times> all;
  for (int i = 0; i < repeats; ++i) all.push_back(OneIteration(iteration));
  Times median{};
  for (size_t k = 0; k < kPhases.size(); ++k) {
    std::vector<double> values;
    for (const Times& t : all) values.push_back(t[k]);
    std::nth_element(values.begin(), values.begin() + repeats / 2, values.end());
    median[k] = values[repeats / 2];
  }
  return median;
}

double Sum(const Times& t) {
  double sum = 0.0;
  for (const double v : t) sum += v;
  return sum;
}

Json Measure(const SyntheticLoad& load, int threads, int repeats) {
  SyntheticIteration iteration(load, threads);
  const Times ms = Medians(iteration, repeats);
  const double covered = static_cast<double>(std::max<int64_t>(1, iteration.CoveredPixels()));
  Json result{{"gaussians", load.gaussians},
              {"width_px", load.width_px},
              {"height_px", load.height_px},
              {"channels", load.channels},
              {"threads", threads},
              {"visible", iteration.VisibleGaussians()},
              {"pairs", iteration.Pairs()},
              {"covered_pixels", covered},
              {"iteration_ms", Sum(ms)}};
  for (size_t k = 0; k < kPhases.size(); ++k) result[std::string(kPhases[k]) + "_ms"] = ms[k];
  result["forward_backward_ns_per_covered_pixel"] = 1e6 * (ms[2] + ms[4]) / covered;
  return result;
}

// Fits ms ~ Gaussians^p * covered^q by least squares of the logarithms, where covered is the mean
// number of pixels that a Gaussian covers. At most linear growth: p and q are 1 or less.
struct Exponents {
  double gaussians = 0.0;
  double covered = 0.0;
};
Exponents FitExponents(const std::vector<Json>& results) {
  std::vector<std::array<double, 3>> logs;
  std::array<double, 3> mean{};
  for (const Json& r : results) {
    const double gaussians = r["gaussians"].get<double>();
    logs.push_back({std::log(gaussians),
                    std::log(r["covered_pixels"].get<double>() / gaussians),
                    std::log(r["iteration_ms"].get<double>())});
    for (int k = 0; k < 3; ++k) mean[k] += logs.back()[k] / static_cast<double>(results.size());
  }
  double aa = 0.0, ab = 0.0, bb = 0.0, at = 0.0, bt = 0.0;
  for (const auto& log : logs) {
    const double a = log[0] - mean[0], b = log[1] - mean[1], t = log[2] - mean[2];
    aa += a * a;
    ab += a * b;
    bb += b * b;
    at += a * t;
    bt += b * t;
  }
  const double det = aa * bb - ab * ab;
  return {(at * bb - bt * ab) / det, (bt * aa - at * ab) / det};
}

// Bytes of training per Gaussian, and per (Gaussian, tile) pair of the current picture.
Json MemoryPerGaussian(int channels) {
  const int row_bytes = 4 * (kColorRow + 16 * channels);
  const int statistics_bytes = 3 * 4;
  const int splat_bytes = 4 * SplatRowFloats(channels) + 4;
  const int binning_bytes = 12 + 2 * 8 + 24 + 4;  // tile rows, depth order twice, footprint, offset
  return Json{{"channels", channels},
              {"parameters", row_bytes},
              {"moments", 2 * row_bytes},
              {"gradient", row_bytes},
              {"statistics", statistics_bytes},
              {"splat_row", splat_bytes},
              {"binning", binning_bytes},
              {"total", 4 * row_bytes + statistics_bytes + splat_bytes + binning_bytes},
              {"per_pair", 4 + 4 + 2 + 4 * GradientRowFloats(channels)}};
}

void PrintTable(const Json& report) {
  std::printf("instruction set %s\n", report["instruction_set"].get<std::string>().c_str());
  std::printf("%9s %10s %2s %2s %9s %10s %9s %7s %8s %7s %8s %7s %7s %9s %8s\n",
              "gaussians",
              "size",
              "ch",
              "th",
              "pairs",
              "Mpx cover",
              "iter ms",
              "project",
              "bin",
              "forward",
              "backward",
              "proj bw",
              "adam",
              "ns/px f+b",
              "speed-up");
  for (const Json& r : report["cases"]) {
    const std::string size =
        fmt::format("{}x{}", r["width_px"].get<int>(), r["height_px"].get<int>());
    std::printf("%9d %10s %2d %2d %9lld %10.2f %9.2f %7.2f %8.2f %7.2f %8.2f %7.2f %7.2f %9.3f",
                r["gaussians"].get<int>(),
                size.c_str(),
                r["channels"].get<int>(),
                r["threads"].get<int>(),
                static_cast<long long>(r["pairs"].get<int64_t>()),
                1e-6 * r["covered_pixels"].get<double>(),
                r["iteration_ms"].get<double>(),
                r["project_ms"].get<double>(),
                r["bin_ms"].get<double>(),
                r["forward_ms"].get<double>(),
                r["backward_ms"].get<double>(),
                r["project_backward_ms"].get<double>(),
                r["adam_ms"].get<double>(),
                r["forward_backward_ns_per_covered_pixel"].get<double>());
    if (r.contains("speed_up")) std::printf(" %8.2f", r["speed_up"].get<double>());
    std::printf("\n");
  }
  for (const Json& e : report["exponents"]) {
    std::printf("%d channels, %d threads: ms ~ Gaussians^%.2f * (pixels covered by one)^%.2f\n",
                e["channels"].get<int>(),
                e["threads"].get<int>(),
                e["gaussians"].get<double>(),
                e["covered_pixels_of_one"].get<double>());
  }
  for (const Json& m : report["bytes_per_gaussian"]) {
    std::printf("%d channels: %d bytes per Gaussian and %d per (Gaussian, tile) pair\n",
                m["channels"].get<int>(),
                m["total"].get<int>(),
                m["per_pair"].get<int>());
  }
}

std::vector<SyntheticLoad> Loads(bool quick, int channels) {
  std::vector<SyntheticLoad> loads;
  for (const int gaussians : {1'000, 10'000, 100'000, 1'000'000}) {
    for (const int side : {256, 512, 1024, 2048}) {
      if (quick && (gaussians > 100'000 || side > 512)) continue;
      loads.push_back({gaussians, side, side, channels});
    }
  }
  loads.push_back({50'000, 500, 375, channels});  // the loads of the published comparison
  loads.push_back({50'000, 523, 386, channels});
  return loads;
}

void RunRasterize(const RasterizeArguments& args) {
  Json report{{"instruction_set", ActiveInstructionSet()}};
  std::map<std::pair<int, int>, std::vector<Json>> groups;  // by channels and threads
  for (const int channels : {1, 3}) {
    for (const SyntheticLoad& load : Loads(args.quick, channels)) {
      double one_thread_ms = 0.0;
      for (const int threads : {1, 2}) {
        Json result = Measure(load, threads, args.repeats);
        const double ms = result["iteration_ms"].get<double>();
        if (threads == 1) one_thread_ms = ms;
        if (threads == 2) result["speed_up"] = one_thread_ms / ms;
        groups[{channels, threads}].push_back(result);
        report["cases"].push_back(std::move(result));
      }
    }
    report["bytes_per_gaussian"].push_back(MemoryPerGaussian(channels));
  }
  for (const auto& [key, results] : groups) {
    const Exponents e = FitExponents(results);
    report["exponents"].push_back({{"channels", key.first},
                                   {"threads", key.second},
                                   {"gaussians", e.gaussians},
                                   {"covered_pixels_of_one", e.covered}});
  }
  if (!args.json_file.empty()) PrintTable(report);
  WriteResult(report, args.json_file);
}

}  // namespace

void AddRasterizeCommand(CLI::App& app) {
  auto args = std::make_shared<RasterizeArguments>();
  CLI::App* command = app.add_subcommand("rasterize",
                                         "Measure the parts of a training iteration against number "
                                         "of Gaussians, picture size and threads");
  command->add_flag("--quick", args->quick, "Only up to 100,000 Gaussians and 512 px");
  command
      ->add_option(
          "--repeats", args->repeats, "Number of iterations per load, of which the median counts")
      ->check(CLI::Range(1, 1000));
  command->add_option(
      "--json",
      args->json_file,
      "File for the result (JSON), which also prints a table; default: standard output");
  command->callback([args] { RunRasterize(*args); });
}

}  // namespace color3d
