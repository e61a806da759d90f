// What requests of the page say. Functions of requests and files; thread-safe as PhotoSets.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "client/studio/http_library.h"
#include "client/studio/photo_sets.h"
#include "client/studio/studio_calls.h"

namespace color3d::client {

// Returns "" if the field is missing. Throws Error{kInvalidArgument} if it is no text.
std::string TextOf(const nlohmann::json& body, const char* field);
// Whether the field is true.
bool FlagOf(const nlohmann::json& body, const char* field);
// `preset` of a request, "fast" by default: a name, never a file. Throws Error{kInvalidArgument}.
std::string PresetOf(const nlohmann::json& body);

// Longer side of a picture, px; 0 if it is not given. Throws Error{kInvalidArgument}.
int SideOf(const httplib::Request& request);

// `frame`: number of a frame of a film, from 0. Throws Error{kInvalidArgument}.
int FrameNumberOf(const httplib::Request& request);

nlohmann::ordered_json SetJson(const PhotoSet& set);

// The colours of a photo of the set and strokes above them. Throws Error{kInvalidArgument}.
ColorChoice ReadColor(const nlohmann::json& body, const std::string& set, PhotoSets& sets);

// A photo of the set, named by `key_view`, and its colours; strokes are kept beside the set. Throws
// Error{kInvalidArgument}.
KeyChoice ReadKey(const nlohmann::json& body, const std::string& set, PhotoSets& sets);

// Choices for a run of the set; strokes are kept beside it. Throws Error{kInvalidArgument}.
RunChoices ReadChoices(const nlohmann::json& body, const std::string& set, PhotoSets& sets);

}  // namespace color3d::client
