// color3d-bench plot: draws error against seconds of several results, with a panel per scene.
// `reconstruct`: a line per label. `suite`: a line per preset from the curves of its runs or,
// with --metric, through its runs. `choices`: a panel per choice with means over the scenes.
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/report/plot.h"
#include "core/stage/formats/artifact_io.h"
#include "tests/bench/colorizer/choice_results.h"
#include "tests/bench/commands.h"
#include "tests/bench/suite/suite_rows.h"

namespace color3d {
namespace {

struct PlotArguments {
  std::vector<std::string> json_files;
  std::string svg_file;
  std::string quality = "psnr_db";
  std::string label = "preset";
  std::string suite_folder;
  std::string curve;   // STAGE:ERROR_NAME
  std::string metric;  // of metrics.json
  std::string seconds = "seconds_total";
  std::vector<std::string> choices_folders;
  bool delivered = false;
  bool linear = false;
};

Plot& PlotOfTitle(const std::string& title, bool log_seconds, std::vector<Plot>& plots) {
  for (Plot& plot : plots) {
    if (plot.title == title) return plot;
  }
  plots.push_back({title, {}, log_seconds});
  return plots.back();
}

PlotSeries& SeriesOf(const std::string& name, Plot& plot) {
  for (PlotSeries& series : plot.series) {
    if (series.name == name) return series;
  }
  plot.series.push_back({name, {}});
  return plot.series.back();
}

void AddResult(const std::string& file, const PlotArguments& args, std::vector<Plot>& plots) {
  const auto json = nlohmann::json::parse(ReadFile(file));
  const std::filesystem::path scene = json.at("scene").get<std::string>();
  PlotSeries series;
  series.name = json.value(args.label, file);
  for (const auto& point : json.at("held_out")) {
    series.points.push_back({"", point.at("seconds"), 0, args.quality, point.at(args.quality)});
  }
  if (series.points.empty()) throw InvalidArgument(file + " has no held-out views");
  const std::string name =
      scene.has_filename() ? scene.filename().string() : scene.parent_path().filename().string();
  PlotOfTitle(name + ": " + args.quality, !args.linear, plots).series.push_back(std::move(series));
}

// The curve of one run.
void AddCurve(const SuiteRow& run, const PlotArguments& args, std::vector<Plot>& plots) {
  const size_t colon = args.curve.find(':');
  if (colon == std::string::npos) {
    throw InvalidArgument("\"" + args.curve + "\" is not a curve; give STAGE:ERROR_NAME");
  }
  const std::string stage = args.curve.substr(0, colon), error = args.curve.substr(colon + 1);
  const std::filesystem::path file = std::filesystem::path(args.suite_folder) / run.scene /
                                     run.preset / std::to_string(run.seed) / artifact::kAllCurves;
  Plot& plot = PlotOfTitle(run.scene + ": " + error, !args.linear, plots);
  for (const CurvePoint& point : CurvesFromCsv(ReadFile(file))) {
    if (point.stage != stage || point.error_name != error) continue;
    SeriesOf(run.preset, plot).points.push_back(point);
  }
}

// A run as a point of the line of its preset.
void AddPoint(const SuiteRow& run, const PlotArguments& args, std::vector<Plot>& plots) {
  Plot& plot = PlotOfTitle(run.scene + ": " + args.metric, !args.linear, plots);
  const double seconds = run.metrics.at(args.seconds), value = run.metrics.at(args.metric);
  SeriesOf(run.preset, plot).points.push_back({"", seconds, 0, args.metric, value});
}

void AddSuite(const PlotArguments& args, std::vector<Plot>& plots) {
  if (args.curve.empty() == args.metric.empty()) {
    throw InvalidArgument("a figure of a suite shows either --curve or --metric");
  }
  const std::filesystem::path jsonl = std::filesystem::path(args.suite_folder) / "results.jsonl";
  for (const SuiteRow& run : ReadRows(jsonl)) {
    if (run.Failed()) continue;
    args.curve.empty() ? AddPoint(run, args, plots) : AddCurve(run, args, plots);
  }
  for (Plot& plot : plots) {
    for (PlotSeries& series : plot.series) {
      std::stable_sort(
          series.points.begin(), series.points.end(), [](const CurvePoint& x, const CurvePoint& y) {
            return x.seconds < y.seconds;
          });
    }
  }
  if (plots.empty()) throw InvalidArgument(jsonl.string() + " has no finished runs");
}

void AddChoices(const PlotArguments& args, std::vector<Plot>& plots) {
  const auto points = ReadChoiceFolders(args.choices_folders);
  for (Plot& plot : ChoicePlots(points, args.delivered)) {
    plot.log_seconds = !args.linear;
    plots.push_back(std::move(plot));
  }
}

void RunPlot(const PlotArguments& args) {
  std::vector<Plot> plots;
  std::string file = args.suite_folder;
  try {
    if (!args.suite_folder.empty()) AddSuite(args, plots);
    AddChoices(args, plots);
    for (const std::string& result : args.json_files) {
      file = result;
      AddResult(file, args, plots);
    }
  } catch (const nlohmann::json::exception& e) {
    throw InvalidArgument(file + " has none of these figures: " + e.what());
  }
  if (plots.empty()) throw InvalidArgument("give results of reconstruct, --suite or --choices");
  WriteFileAtomic(args.svg_file, FigureSvg(plots));
}

}  // namespace

void AddPlotCommand(CLI::App& app) {
  auto args = std::make_shared<PlotArguments>();
  CLI::App* command =
      app.add_subcommand("plot", "Draw error against seconds of several results as SVG");
  command->add_option("files", args->json_files, "Results of `reconstruct`");
  command->add_option("--svg", args->svg_file, "File for the figure")->required();
  command->add_option("--quality", args->quality, "Quality to draw: psnr_db, ssim or l1")
      ->capture_default_str();
  command->add_option("--label", args->label, "Field of the results that names a line")
      ->capture_default_str();
  command->add_option("--suite", args->suite_folder, "Output folder of `suite`");
  command->add_option("--curve", args->curve, "Curve of its curves.csv: STAGE:ERROR_NAME");
  command->add_option(
      "--metric", args->metric, "Metric of its metrics.json, e.g. delta_e00_chroma_2d");
  command
      ->add_option("--seconds", args->seconds, "Seconds of its metrics.json to draw with --metric")
      ->capture_default_str();
  command->add_option("--choices", args->choices_folders, "Output folders of `choices`");
  command->add_flag("--delivered",
                    args->delivered,
                    "With --choices: draw the error after fusion with carried colours");
  command->add_flag("--linear", args->linear, "Draw seconds on a linear axis");
  command->callback([args] { RunPlot(*args); });
}

}  // namespace color3d
