#include "core/stage/report/repeat_section.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/base/digest.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {
namespace {

// Quotes a name as one word of a shell.
std::string ShellWord(const std::string& text) {
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

void AddDigest(const char* name, const StageContext& context, ReportData* data) {
  if (!context.HasInput(name)) return;
  data->facts.emplace_back(fmt::format("SHA-256 of {}", name),
                           DigestFile(context.Input(name)).sha256);
}

// The flags for the source of the colour of the key view; empty if its text or file is not kept.
std::string ColorFlags(bool has_truth, const StageContext& context) {
  if (has_truth) return " --benchmark";
  if (!context.HasInput(artifact::kKeyColorFacts)) return "";
  const auto facts = ReadJson(context, artifact::kKeyColorFacts);
  const std::string source = facts.value("source", "");
  if (source == "image") return " --key-color COLOURED.png";
  return source == "automatic" ? " --auto" : "";
}

// The flags for key views that recolour ranges of a film. `number`: that of the first picture.
std::string RangeFlags(size_t number, const StageContext& context) {
  if (!context.HasInput(artifact::kCorrections)) return "";
  const auto facts = ReadJson(context, artifact::kCorrections);
  const auto seconds = [](const auto& range, const char* name) {
    return range.contains(name) ? fmt::format("{}", range.at(name).template get<double>()) : "";
  };
  std::string flags;
  for (const auto& range : facts.value("recolored", nlohmann::ordered_json::array())) {
    flags += " --add-key-view " + ShellWord(fmt::format("{}=COLOURED_{}.png@{}-{}",
                                                        range.at("view").get<std::string>(),
                                                        number++,
                                                        seconds(range, "begin_s"),
                                                        seconds(range, "end_s")));
  }
  return flags;
}

}  // namespace

void AddHowToRepeat(const std::vector<std::string>& keys,
                    bool has_truth,
                    const StageContext& context,
                    ReportData* data) {
  const std::string color = ColorFlags(has_truth, context);
  if (!keys.empty() && !color.empty() && (keys.size() == 1 || !has_truth)) {
    std::string command = fmt::format("color3d colorize PHOTOS -o OUT --seed {} --key-view {}{}",
                                      context.seed(),
                                      ShellWord(keys.front()),
                                      color);
    for (size_t i = 1; i < keys.size(); ++i) {
      command +=
          " --add-key-view " + ShellWord(keys[i] + "=COLOURED_" + std::to_string(i) + ".png");
    }
    command += RangeFlags(keys.size(), context);
    data->repeat.push_back(command);
  } else if (has_truth && keys.size() > 1) {
    data->repeat.push_back(
        fmt::format("color3d colorize PHOTOS -o OUT --seed {} --benchmark --keys {}",
                    context.seed(),
                    keys.size()));
  }
  if (!data->view_page.empty()) data->repeat.push_back("color3d view OUT");
  if (!data->repeat.empty()) {
    data->repeat_notes.push_back(
        "PHOTOS is the folder of the photos, OUT a folder for the results, COLOURED.png the "
        "coloured "
        "key view. Add the preset and other options that differed from the defaults. The same seed "
        "on the same kind of machine gives the same result.");
  }
  data->facts.emplace_back("Color3D", COLOR3D_VERSION);
  data->facts.emplace_back("seed", std::to_string(context.seed()));
  for (const char* name : {artifact::kKeyColor, artifact::kModel, artifact::kPly, artifact::kSog}) {
    AddDigest(name, context, data);
  }
  data->facts.emplace_back(
      "licence of the embedded weights",
      "The project's code is Apache-2.0. The embedded weights were trained on photographs that are "
      "provided for non-commercial research; use them accordingly. Your own weights and backends "
      "have their own licences.");
}

}  // namespace color3d
