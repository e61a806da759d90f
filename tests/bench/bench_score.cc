// color3d-bench score: scores a folder of pictures of any method against photos in true colours.
#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "core/base/error.h"
#include "core/catalogue/metrics.h"
#include "tests/bench/commands.h"
#include "tests/bench/picture_scores.h"
#include "tests/bench/result_file.h"

namespace color3d {
namespace {

struct ScoreArguments {
  std::string truth;
  std::string pictures;
  std::vector<std::string> views;
  std::string json;
  int threads = 2;
};

// In the order of the table.
constexpr const char* kShown[] = {"delta_e00_chroma",
                                  "delta_e00",
                                  "delta_e00_gray",
                                  "psnr_rgb",
                                  "ssim_rgb",
                                  "colorfulness",
                                  "colorfulness_truth"};

void RunScore(const ScoreArguments& args) {
  ThreadPool pool(args.threads);
  const std::vector<PictureScores> views =
      ScorePictures(args.truth, args.pictures, args.views, pool, CancellationToken());
  nlohmann::ordered_json json;
  json["views"] = views.size();
  std::string table = fmt::format("{:<24}", "view");
  for (const char* name : kShown) table += fmt::format(" {:>18}", name);
  for (const PictureScores& view : views) {
    table += fmt::format("\n{:<24}", view.view);
    for (const char* name : kShown) table += fmt::format(" {:>18.3f}", view.scores.at(name));
    json["scores"][view.view] = view.scores;
  }
  table += fmt::format("\n{:<24}", "mean");
  std::string interval = fmt::format("\n{:<24}", "95 % interval");
  for (const char* name : kShown) {
    std::vector<double> values;
    for (const PictureScores& view : views) values.push_back(view.scores.at(name));
    const MeanWithInterval over_views = BootstrapMean(values);
    table += fmt::format(" {:>18.3f}", over_views.mean);
    interval +=
        fmt::format(" {:>18}", fmt::format("{:.3f}..{:.3f}", over_views.low, over_views.high));
    json["mean"][name] = over_views.mean;
    json["interval_95"][name] = {over_views.low, over_views.high};
  }
  std::printf("%s%s\n", table.c_str(), interval.c_str());
  if (!args.json.empty()) WriteResult(json, args.json);
}

}  // namespace

void AddScoreCommand(CLI::App& app) {
  auto args = std::make_shared<ScoreArguments>();
  CLI::App* command = app.add_subcommand(
      "score", "Score the pictures of any method against photos in their true colours");
  command->add_option("TRUTH", args->truth, "Folder of photos in colour")->required();
  command
      ->add_option("PICTURES",
                   args->pictures,
                   "Folder of the method's pictures, named as the photos (any extension)")
      ->required();
  command->add_option(
      "--view", args->views, "Photos to score, all of which need a picture; default: all pictures");
  command->add_option("--json", args->json, "File for the scores of all views as JSON");
  command->add_option("--threads", args->threads, "Number of threads")->capture_default_str();
  command->callback([args] { RunScore(*args); });
}

}  // namespace color3d
