#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/keycolor/hints/hints.h"

namespace color3d {
namespace {

using Json = nlohmann::json;

constexpr size_t kMaxHints = 100000;
constexpr size_t kMaxPoints = 10000;

double Number(const Json& entry, const char* field, const std::string& name) {
  if (!entry.contains(field) || !entry[field].is_number()) {
    throw InvalidArgument("{} lacks the number \"{}\"", name, field);
  }
  return entry[field].get<double>();
}

// "#rrggbb" to Lab. Only a and b are used; L remains that of the photo.
LabColor ParseHexColor(const std::string& text, const std::string& name) {
  bool valid = text.size() == 7 && text[0] == '#';
  for (size_t i = 1; valid && i < 7; ++i) {
    valid = std::isxdigit(static_cast<unsigned char>(text[i])) != 0;
  }
  if (!valid) {
    throw InvalidArgument(
        "{} has the color \"{}\"; it must look like \"#a0522d\"", name, text.substr(0, 32));
  }
  const unsigned long value = std::stoul(text.substr(1), nullptr, 16);
  return LabFromSrgb(RgbColor{static_cast<double>(value >> 16 & 255) / 255.0,
                              static_cast<double>(value >> 8 & 255) / 255.0,
                              static_cast<double>(value & 255) / 255.0});
}

std::vector<std::array<double, 2>> Points(const Json& points, const std::string& name) {
  const char* shape = "it must look like [[10, 20], [80, 25], ...]";
  if (!points.is_array() || points.empty() || points.size() > kMaxPoints) {
    throw InvalidArgument("{} has no list of 1 to {} points; {}", name, kMaxPoints, shape);
  }
  std::vector<std::array<double, 2>> result;
  for (const Json& point : points) {
    if (!point.is_array() || point.size() != 2 || !point[0].is_number() || !point[1].is_number()) {
      throw InvalidArgument("{} has a point that is not a pair of numbers; {}", name, shape);
    }
    result.push_back({point[0].get<double>(), point[1].get<double>()});
  }
  return result;
}

// Reads the shape of an entry: "x", "line", "region" or "label", with its fields.
void ParseShape(const Json& entry, const std::string& name, ColorHint& hint) {
  if (entry.contains("line")) {
    hint.shape = ColorHint::Shape::kLine;
    hint.points_px = Points(entry["line"], name);
    if (entry.contains("width")) hint.radius_px = Number(entry, "width", name) / 2.0;
  } else if (entry.contains("region")) {
    hint.shape = ColorHint::Shape::kRegion;
    hint.points_px = Points(entry["region"], name);
  } else if (entry.contains("label")) {
    hint.shape = ColorHint::Shape::kLabel;
    const double label = Number(entry, "label", name);
    if (label != std::floor(label) || label < 0.0 || label > 255.0) {
      throw InvalidArgument("{} has a label that is not an integer from 0 to 255", name);
    }
    hint.label = static_cast<int>(label);
  } else {
    hint.x_px = Number(entry, "x", name);
    hint.y_px = Number(entry, "y", name);
    if (entry.contains("radius")) hint.radius_px = Number(entry, "radius", name);
  }
  if (hint.x_px < 0.0 || hint.y_px < 0.0 || hint.radius_px < 0.0) {
    throw InvalidArgument("{} has a negative coordinate, radius or width", name);
  }
}

void ParseFill(const Json& entry, const std::string& name, ColorHint& hint) {
  if (entry.contains("keep")) {
    const std::string keep = entry["keep"].is_string() ? entry["keep"].get<std::string>() : "";
    if (entry.contains("color")) throw InvalidArgument("{} has both \"color\" and \"keep\"", name);
    if (keep != "neutral" && keep != "auto") {
      throw InvalidArgument("{} has a \"keep\" that is neither \"neutral\" nor \"auto\"", name);
    }
    hint.fill = keep == "auto" ? ColorHint::Fill::kAutomatic : ColorHint::Fill::kNeutral;
    return;
  }
  if (!entry.contains("color") || !entry["color"].is_string()) {
    throw InvalidArgument("{} lacks the text \"color\", such as \"#a0522d\"", name);
  }
  const LabColor lab = ParseHexColor(entry["color"].get<std::string>(), name);
  hint.a = lab.a;
  hint.b = lab.b;
}

double Reach(const Json& entry, const std::string& name) {
  const double reach = Number(entry, "reach", name);
  if (!(reach >= kMinReach && reach <= kMaxReach)) {
    throw InvalidArgument(
        "{} has the reach {}; it must be between {} and {}", name, reach, kMinReach, kMaxReach);
  }
  return reach;
}

// Fields of an entry by its shape, without "color", "keep" and "reach".
std::vector<std::string> AllowedFields(const Json& entry) {
  if (entry.contains("line")) return {"line", "width"};
  if (entry.contains("region")) return {"region"};
  if (entry.contains("label")) return {"label"};
  return {"x", "y", "radius"};
}

ColorHint ParseHint(const Json& entry, const std::string& name) {
  if (!entry.is_object()) throw InvalidArgument("{} is not an object", name);
  std::vector<std::string> fields = AllowedFields(entry);
  fields.insert(fields.end(), {"color", "keep", "reach"});
  for (const auto& [key, value] : entry.items()) {
    if (std::find(fields.begin(), fields.end(), key) != fields.end()) continue;
    std::string known;
    for (const std::string& field : fields) known += (known.empty() ? "" : ", ") + field;
    throw InvalidArgument("{} has an unknown field \"{}\"; known for this shape are {}",
                          name,
                          key.substr(0, 32),
                          known);
  }
  ColorHint hint;
  ParseShape(entry, name, hint);
  ParseFill(entry, name, hint);
  if (entry.contains("reach")) hint.reach = Reach(entry, name);
  return hint;
}

}  // namespace

std::vector<ColorHint> ParseHintsJson(const std::string& json) {
  Json parsed;
  try {
    parsed = Json::parse(json);
  } catch (const Json::exception& error) {
    throw InvalidArgument("the colour hints are not JSON: {}", error.what());
  }
  if (!parsed.is_array() || parsed.empty() || parsed.size() > kMaxHints) {
    throw InvalidArgument("the colour hints must be a JSON list of 1 to {} entries", kMaxHints);
  }
  std::vector<ColorHint> hints;
  for (size_t i = 0; i < parsed.size(); ++i) {
    hints.push_back(ParseHint(parsed[i], fmt::format("colour hint {}", i)));
  }
  return hints;
}

}  // namespace color3d
