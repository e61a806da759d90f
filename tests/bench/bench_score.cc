// color3d-bench score: scores a folder of pictures of any method against photos in true colours.
#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "core/base/error.h"
#include "core/catalogue/metrics.h"
#include "core/metrics/confidence_interval.h"
#include "tests/bench/commands.h"
#include "tests/bench/picture_scores.h"
#include "tests/bench/result_file.h"
#include "tests/bench/scene_scores.h"

namespace color3d {
namespace {

struct ScoreArguments {
  std::string truth;
  std::string pictures;
  std::vector<std::string> views;
  std::string json;
  int threads = 2;
  PerceptualOptions perception;
};

// In the order of the table.
constexpr const char* kShown[] = {"delta_e00_chroma",
                                  "delta_e00_chroma_p90",
                                  "delta_e00",
                                  "delta_e00_gray",
                                  "psnr_rgb",
                                  "ssim_rgb",
                                  "colorfulness",
                                  "colorfulness_truth"};

// Adds the scores of the set to `json` and returns their lines.
std::string SetScores(const std::vector<PictureScores>& views,
                      const ScoreArguments& args,
                      ThreadPool& pool,
                      nlohmann::ordered_json* json) {
  const CancellationToken cancel;
  std::string text;
  const Consistency common = ScoreCommonMatches(views, pool, cancel);
  if (common.matches > 0) {
    (*json)["matches_common"] = common.matches;
    for (const auto& [name, value] : common.Figures()) (*json)[name + "_common"] = value;
    text += fmt::format("\nme_common {:.4f}  me_de00_common {:.2f}  tc_common {:.5f}  ({} matches)",
                        common.me,
                        common.me_de00,
                        common.tc,
                        common.matches);
  }
  const PerceptualScores perception = ScorePerception(views, args.perception, cancel);
  if (perception.fid) {
    (*json)["fid"] = {{"value", *perception.fid},
                      {"pictures", views.size()},
                      {"is_biased", perception.fid_is_biased}};
    text += fmt::format("\nfid {:.2f} of {} pictures{}",
                        *perception.fid,
                        views.size(),
                        perception.fid_is_biased ? " (biased: too few)" : "");
  }
  for (const auto& [name, values] : perception.of_views) {
    const MeanWithInterval mean = BootstrapMean(values);
    for (size_t i = 0; i < views.size(); ++i) (*json)["scores"][views[i].view][name] = values[i];
    (*json)["mean"][name] = mean.mean;
    (*json)["interval_95"][name] = {mean.low, mean.high};
    text += fmt::format("\n{} {:.4f} ({:.4f}..{:.4f})", name, mean.mean, mean.low, mean.high);
  }
  for (const auto& [name, reason] : perception.left_out) {
    (*json)["left_out"][name] = reason;
    text += fmt::format("\n{} left out: {}", name, reason);
  }
  return text;
}

void RunScore(const ScoreArguments& args) {
  args.perception.Validate();
  ThreadPool pool(args.threads);
  const std::vector<PictureScores> views =
      ScorePictures(args.truth, args.pictures, args.views, pool, CancellationToken());
  nlohmann::ordered_json json;
  json["views"] = views.size();
  std::string table = fmt::format("{:<24}", "view");
  for (const char* name : kShown) table += fmt::format(" {:>20}", name);
  for (const PictureScores& view : views) {
    table += fmt::format("\n{:<24}", view.view);
    for (const char* name : kShown) table += fmt::format(" {:>20.3f}", view.scores.at(name));
    json["scores"][view.view] = view.scores;
  }
  table += fmt::format("\n{:<24}", "mean");
  std::string interval = fmt::format("\n{:<24}", "95 % interval");
  for (const char* name : kShown) {
    std::vector<double> values;
    for (const PictureScores& view : views) values.push_back(view.scores.at(name));
    const MeanWithInterval over_views = BootstrapMean(values);
    table += fmt::format(" {:>20.3f}", over_views.mean);
    interval +=
        fmt::format(" {:>20}", fmt::format("{:.3f}..{:.3f}", over_views.low, over_views.high));
    json["mean"][name] = over_views.mean;
    json["interval_95"][name] = {over_views.low, over_views.high};
  }
  const std::string set = SetScores(views, args, pool, &json);
  std::printf("%s%s%s\n", table.c_str(), interval.c_str(), set.c_str());
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
  PerceptualOptions& perception = args->perception;
  command->add_option(
      "--fid-weights", perception.fid_weights, "Inception v3 (pytorch-fid or torchvision): FID");
  command->add_flag("--biased-fid",
                    perception.allow_biased_fid,
                    "Compute FID of fewer pictures than features, and mark it as biased");
  command->add_option("--lpips-weights",
                      perception.lpips_weights,
                      "alexnet or vgg16 of torchvision: LPIPS to the reference");
  command->add_option(
      "--lpips-linear", perception.lpips_linear, "Linear layers of LPIPS for this backbone");
  command->add_option("--reference", perception.reference, "Coloured key view, for LPIPS");
  command->add_option("--clip-weights", perception.clip_weights, "CLIP: score of the prompt");
  command->add_option("--prompt", perception.prompt, "Text that the pictures were coloured after");
  command->add_option("--threads", args->threads, "Number of threads")->capture_default_str();
  command->callback([args] { RunScore(*args); });
}

}  // namespace color3d
