// The part of the studio's HTTP calls that is about films (client/studio/README.md).
#pragma once

#include <functional>
#include <string>

#include "client/studio/film/film_calls.h"
#include "client/studio/film/film_frames.h"
#include "client/studio/http_library.h"
#include "client/studio/photo_sets.h"
#include "client/studio/studio_calls.h"
#include "client/studio/studio_routes.h"

namespace color3d::client {

// What the calls work with; all must outlive the routes.
struct FilmRouteParts {
  PhotoSets& sets;
  SharedConnection& connection;
  FilmFrames& frames;
  // Files of a set, as frames if it says so.
  std::function<PhotoFolder(const std::string& set)> folder_of;
  // "scenes/..." of a set, uploaded if it is not there yet.
  std::function<std::string(const std::string& set)> scene_of;
  // Fetches an artifact of a job. Returns its file.
  std::function<std::filesystem::path(const std::string& job, const std::string& name)> fetch;
};

void AddFilmRoutes(const FilmRouteParts& parts, const StudioRoutes& routes);

// Answers with a file or the part of it that the request asks for, read as it is sent.
void AnswerFile(const std::filesystem::path& file,
                const std::string& media_type,
                httplib::Response& response);

}  // namespace color3d::client
