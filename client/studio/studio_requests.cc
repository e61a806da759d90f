#include "client/studio/studio_requests.h"

#include <cstdlib>

#include "client/studio/run_progress.h"
#include "core/base/error.h"

namespace color3d::client {
namespace {

using httplib::Request;
using Json = nlohmann::ordered_json;
constexpr int kMaxSidePx = 8192;

// A photo and its colours.
RunChoices ReadKeyView(const nlohmann::json& body, const std::string& set, PhotoSets& sets) {
  RunChoices choices;
  choices.key_view = TextOf(body, "key_view");
  const std::string color = TextOf(body, "color");
  if (color.empty() || color == "automatic") return choices;
  choices.automatic = false;
  if (color == "strokes") {
    const auto strokes = body.find("strokes");
    if (strokes == body.end() || !strokes->is_array() || strokes->empty()) {
      throw InvalidArgument("there are no strokes yet; draw one, or choose automatic colours");
    }
    choices.is_strokes = true;
    choices.picture = sets.KeepPicture(set, ".json", strokes->dump());
    return choices;
  }
  if (color != "picture") throw InvalidArgument("color is automatic, picture or strokes");
  const std::string picture = TextOf(body, "picture");
  choices.picture = sets.KeptPicture(set, picture);
  return choices;
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

Json SetJson(const PhotoSet& set) {
  return {{"id", set.id},
          {"name", set.name},
          {"scene", set.scene.empty() ? "" : IdOf(set.scene)},
          {"created_s", set.created_s},
          {"is_own", set.is_own},
          {"as_frames", set.as_frames}};
}

RunChoices ReadChoices(const nlohmann::json& body, const std::string& set, PhotoSets& sets) {
  RunChoices choices = ReadKeyView(body, set, sets);
  const std::string preset = TextOf(body, "preset");
  if (preset.find_first_not_of("abcdefghijklmnopqrstuvwxyz_") != preset.npos) {
    throw InvalidArgument("the preset {} is unknown", preset.substr(0, 40));  // never a file
  }
  if (!preset.empty()) choices.preset = preset;
  const auto poses = body.find("poses");
  choices.poses = poses != body.end() && *poses == true;
  const auto further = body.find("further");
  if (further == body.end()) return choices;
  if (!further->is_array()) throw InvalidArgument("further is not a list");
  for (const nlohmann::json& one : *further) {
    if (!one.is_object()) throw InvalidArgument("further is not a list of photos");
    choices.further.push_back(ReadKeyView(one, set, sets));
  }
  return choices;
}

}  // namespace color3d::client
