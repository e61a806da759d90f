#include "client/studio/studio_requests.h"

#include <charconv>
#include <cstdlib>
#include <map>

#include "client/studio/run_progress.h"
#include "core/base/error.h"

namespace color3d::client {
namespace {

using httplib::Request;
using Json = nlohmann::ordered_json;
constexpr int kMaxSidePx = 8192;

// The text of a file of strokes, as it is: the service gets the bytes that a saved file has. Empty
// without strokes.
std::string StrokesOf(const nlohmann::json& body) {
  const std::string text = TextOf(body, "strokes");
  if (text.empty()) return "";
  const auto list = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!list.is_array()) throw InvalidArgument("the strokes are not a JSON list");
  return list.empty() ? "" : text;
}

}  // namespace

std::string TextOf(const nlohmann::json& body, const char* field) {
  const auto value = body.find(field);
  if (value == body.end()) return "";
  if (!value->is_string()) throw InvalidArgument("{} is not a text", field);
  return value->get<std::string>();
}

int SideOf(const Request& request) {
  const std::string text = request.get_param_value("side");
  if (text.empty()) return 0;
  const int side = text.size() <= 4 ? std::atoi(text.c_str()) : 0;
  if (side < 16 || side > kMaxSidePx) {
    throw InvalidArgument("side is {}; 16 to {} px are possible", text.substr(0, 20), kMaxSidePx);
  }
  return side;
}

int FrameNumberOf(const Request& request) {
  const std::string text = request.get_param_value("frame");
  int number = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number < 0) {
    throw InvalidArgument("frame is not a number of the film's frames");
  }
  return number;
}

Json SetJson(const PhotoSet& set) {
  return {{"id", set.id},
          {"name", set.name},
          {"scene", set.scene.empty() ? "" : IdOf(set.scene)},
          {"created_s", set.created_s},
          {"is_own", set.is_own},
          {"as_frames", set.as_frames}};
}

bool FlagOf(const nlohmann::json& body, const char* field) {
  const auto value = body.find(field);
  return value != body.end() && *value == true;
}

ColorChoice ReadColor(const nlohmann::json& body, const std::string& set, PhotoSets& sets) {
  using From = ColorChoice::From;
  static const std::map<std::string, From> kNames = {{"", From::kAutomatic},
                                                     {"automatic", From::kAutomatic},
                                                     {"nothing", From::kNothing},
                                                     {"picture", From::kPicture},
                                                     {"reference", From::kReference},
                                                     {"words", From::kWords}};
  ColorChoice choice;
  const auto from = kNames.find(TextOf(body, "color"));
  if (from == kNames.end()) {
    throw InvalidArgument("color is automatic, nothing, picture, reference or words");
  }
  choice.from = from->second;
  if (choice.from == From::kPicture || choice.from == From::kReference) {
    choice.picture = sets.KeptPicture(set, TextOf(body, "picture"));
  }
  if (choice.from == From::kWords) {
    choice.words = TextOf(body, "words");
    if (choice.words.empty()) {
      throw InvalidArgument("there are no words yet; name things with their colours");
    }
  }
  choice.strokes = StrokesOf(body);
  if (choice.strokes.empty() && choice.from == From::kNothing) {
    throw InvalidArgument("there are no strokes yet; draw one, or choose automatic colours");
  }
  return choice;
}

KeyChoice ReadKey(const nlohmann::json& body, const std::string& set, PhotoSets& sets) {
  KeyChoice key;
  key.view = TextOf(body, "key_view");
  key.color = ReadColor(body, set, sets);
  if (!key.color.strokes.empty()) {
    key.strokes_file = sets.KeepPicture(set, ".json", key.color.strokes);
  }
  return key;
}

std::string PresetOf(const nlohmann::json& body) {
  const std::string preset = TextOf(body, "preset");
  if (preset.find_first_not_of("abcdefghijklmnopqrstuvwxyz_") != preset.npos) {
    throw InvalidArgument("the preset {} is unknown", preset.substr(0, 40));
  }
  return preset.empty() ? "fast" : preset;
}

RunChoices ReadChoices(const nlohmann::json& body, const std::string& set, PhotoSets& sets) {
  RunChoices choices;
  choices.key = ReadKey(body, set, sets);
  choices.preset = PresetOf(body);
  choices.poses = FlagOf(body, "poses");
  const auto further = body.find("further");
  if (further == body.end()) return choices;
  if (!further->is_array()) throw InvalidArgument("further is not a list");
  for (const nlohmann::json& one : *further) {
    if (!one.is_object()) throw InvalidArgument("further is not a list of photos");
    choices.further.push_back(ReadKey(one, set, sets));
  }
  return choices;
}

}  // namespace color3d::client
