#include "core/stage/report/key_view_section.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "core/image/codec.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/key_views.h"

namespace color3d {
namespace {

using nlohmann::ordered_json;

// A JSON value for users: without quotes and braces, numbers with four digits.
std::string FactText(const ordered_json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) return fmt::format("{:.4g}", value.get<double>());
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (!value.is_structured()) return value.dump();
  std::string text;
  for (const auto& [name, part] : value.items()) {
    if (!text.empty()) text += value.is_array() ? "; " : ", ";
    text += (value.is_array() ? "" : name + " ") + FactText(part);
  }
  return text;
}

void AddChoice(const ordered_json& key_view, ReportKeyView* report) {
  for (const char* field : {"description", "encoder"}) {
    const auto found = key_view.find(field);
    if (found == key_view.end() || !found->is_string()) continue;
    const std::string text = *found;
    report->notes.push_back(std::string(field) == "encoder" ? "Features: " + text + "." : text);
  }
}

void AddColor(const ordered_json& facts, ReportKeyView* report) {
  for (const auto& [name, value] : facts.items()) {
    if (name == "view" || name == "warnings" || value.is_null()) continue;
    std::string label = name;
    for (char& c : label) c = c == '_' ? ' ' : c;
    report->color_facts.emplace_back(label, FactText(value));
  }
}

void AddRegions(const std::string& folder, const StageContext& context, ReportKeyView* report) {
  const std::string regions = folder + artifact::kKeyColorRegions;
  if (!context.HasInput(regions)) return;
  report->pictures.pictures.push_back(
      {"regions of the words in the prompt", context.ReadInput(regions)});
}

}  // namespace

ReportPicture SmallPicture(const Image& image, std::string caption, int side_px) {
  return {std::move(caption), EncodeJpeg(FitWithin(image, side_px), 88)};
}

ReportKeyView KeyViewChapter(ReportRow pictures, const StageContext& context) {
  ReportKeyView report;
  report.pictures = std::move(pictures);
  if (context.HasInput(artifact::kKeyView)) {
    AddChoice(ReadJson(context, artifact::kKeyView), &report);
  }
  if (context.HasInput(artifact::kKeyColorFacts)) {
    AddColor(ReadJson(context, artifact::kKeyColorFacts), &report);
  }
  AddRegions("", context, &report);
  if (context.HasInput(artifact::kKeyViewRanking)) {
    report.ranking = {"All candidates, best first", context.ReadInput(artifact::kKeyViewRanking)};
  }
  return report;
}

std::vector<ReportKeyView> AdditionalKeyViewChapters(const Scene& scene,
                                                     int side_px,
                                                     const StageContext& context) {
  std::vector<ReportKeyView> reports;
  for (const std::string& folder : AdditionalKeyViewFolders(context)) {
    const ordered_json facts = ReadJson(context, folder + artifact::kKeyColorFacts);
    const View& view = scene.views[scene.FindView(facts.value("view", ""))];
    ReportKeyView report;
    report.pictures = {
        view.name,
        {SmallPicture(ReadImage(context.scene_folder() / view.image_file), "as captured", side_px),
         SmallPicture(
             ReadPicture(context, folder + artifact::kKeyViewColored), "coloured", side_px)}};
    AddColor(facts, &report);
    AddRegions(folder, context, &report);
    reports.push_back(std::move(report));
  }
  return reports;
}

}  // namespace color3d
