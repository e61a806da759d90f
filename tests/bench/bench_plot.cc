// color3d-bench plot: results of `reconstruct` as one figure, a panel per scene, a line per label.
#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/report/plot.h"
#include "tests/bench/commands.h"

namespace color3d {
namespace {

struct PlotArguments {
  std::vector<std::string> json_files;
  std::string svg_file;
  std::string quality = "psnr_db";
  std::string label = "preset";
};

Plot& PlotOfScene(const std::string& scene, std::vector<Plot>& plots) {
  for (Plot& plot : plots) {
    if (plot.title == scene) return plot;
  }
  plots.push_back({scene, {}, /*log_seconds=*/true});
  return plots.back();
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
  PlotOfScene(name + ": " + args.quality, plots).series.push_back(std::move(series));
}

void RunPlot(const PlotArguments& args) {
  std::vector<Plot> plots;
  for (const std::string& file : args.json_files) {
    try {
      AddResult(file, args, plots);
    } catch (const nlohmann::json::exception& e) {
      throw InvalidArgument(file + " is no result of color3d-bench reconstruct: " + e.what());
    }
  }
  WriteFileAtomic(args.svg_file, FigureSvg(plots));
}

}  // namespace

void AddPlotCommand(CLI::App& app) {
  auto args = std::make_shared<PlotArguments>();
  CLI::App* command =
      app.add_subcommand("plot", "error against seconds of several results, as SVG");
  command->add_option("files", args->json_files, "JSON of `reconstruct`")->required();
  command->add_option("--svg", args->svg_file)->required();
  command->add_option("--quality", args->quality, "psnr_db, ssim or l1")->capture_default_str();
  command->add_option("--label", args->label, "field that names a line")->capture_default_str();
  command->callback([args] { RunPlot(*args); });
}

}  // namespace color3d
