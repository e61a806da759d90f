#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/keycolor/keycolor.h"

namespace color3d {
namespace {

using Json = nlohmann::json;

constexpr size_t kMaxHints = 100000;

double Number(const Json& entry, const char* field, const std::string& name) {
  if (!entry.contains(field) || !entry[field].is_number()) {
    throw InvalidArgument(name + " lacks the number \"" + field + "\"");
  }
  return entry[field].get<double>();
}

// "#rrggbb" -> Lab; only a and b are used, L stays the photo's.
LabColor ParseHexColor(const std::string& text, const std::string& name) {
  bool valid = text.size() == 7 && text[0] == '#';
  for (size_t i = 1; valid && i < 7; ++i) {
    valid = std::isxdigit(static_cast<unsigned char>(text[i])) != 0;
  }
  if (!valid) {
    throw InvalidArgument(name + " has the color \"" + text.substr(0, 32) +
                          "\", it must look like \"#a0522d\"");
  }
  const unsigned long value = std::stoul(text.substr(1), nullptr, 16);
  return LabFromSrgb(RgbColor{static_cast<double>(value >> 16 & 255) / 255.0,
                              static_cast<double>(value >> 8 & 255) / 255.0,
                              static_cast<double>(value & 255) / 255.0});
}

ColorHint ParseHint(const Json& entry, const std::string& name) {
  if (!entry.is_object()) throw InvalidArgument(name + " is not an object");
  for (const auto& [key, value] : entry.items()) {
    if (key != "x" && key != "y" && key != "radius" && key != "color") {
      throw InvalidArgument(name + " has the unknown field \"" + key +
                            "\"; known are x, y, radius and color");
    }
  }
  ColorHint hint;
  hint.x_px = Number(entry, "x", name);
  hint.y_px = Number(entry, "y", name);
  if (entry.contains("radius")) hint.radius_px = Number(entry, "radius", name);
  if (hint.x_px < 0.0 || hint.y_px < 0.0 || hint.radius_px < 0.0) {
    throw InvalidArgument(name + " has a negative coordinate or radius");
  }
  if (!entry.contains("color") || !entry["color"].is_string()) {
    throw InvalidArgument(name + " lacks the text \"color\", such as \"#a0522d\"");
  }
  const LabColor lab = ParseHexColor(entry["color"].get<std::string>(), name);
  hint.a = lab.a;
  hint.b = lab.b;
  return hint;
}

}  // namespace

std::vector<ColorHint> ParseHintsJson(const std::string& json) {
  Json parsed;
  try {
    parsed = Json::parse(json);
  } catch (const Json::exception& error) {
    throw InvalidArgument(std::string("the colour hints are not JSON: ") + error.what());
  }
  if (!parsed.is_array() || parsed.empty() || parsed.size() > kMaxHints) {
    throw InvalidArgument("the colour hints must be a JSON list of 1 to " +
                          std::to_string(kMaxHints) + " entries");
  }
  std::vector<ColorHint> hints;
  for (size_t i = 0; i < parsed.size(); ++i) {
    hints.push_back(ParseHint(parsed[i], "colour hint " + std::to_string(i)));
  }
  return hints;
}

}  // namespace color3d
