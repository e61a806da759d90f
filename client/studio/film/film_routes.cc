#include "client/studio/film/film_routes.h"

#include <algorithm>
#include <fstream>
#include <memory>

#include "client/studio/found_photos.h"
#include "client/studio/run_progress.h"
#include "client/studio/studio_answers.h"
#include "client/studio/studio_requests.h"
#include "core/base/error.h"
#include "core/base/text/lower_case.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

using httplib::ContentReader;
using httplib::Request;
using httplib::Response;

constexpr size_t kPieceBytes = 256 << 10;

// By its ending; browsers look at the bytes themselves.
const char* MediaTypeOfFilm(const fs::path& film) {
  const std::string ending = LowerCase(film.extension().string());
  if (ending == ".webm" || ending == ".mkv") return "video/webm";
  if (ending == ".mov") return "video/quicktime";
  if (ending == ".ogv") return "video/ogg";
  return "video/mp4";
}

const PhotoFolder& RequireFilm(const PhotoFolder& folder) {
  if (IsFilm(folder)) return folder;
  throw Error(ErrorCode::kFailedPrecondition,
              "{} is not a film of one camera; drop one film, or the pictures of one",
              folder.Name());
}

}  // namespace

void AnswerFile(const fs::path& file, const std::string& media_type, Response& response) {
  const auto stream = std::make_shared<std::ifstream>(file, std::ios::binary);
  std::error_code error;
  const auto bytes = fs::file_size(file, error);
  if (!*stream || error) {
    throw Error(ErrorCode::kNotFound, "{} is gone; reload the page", file.filename().string());
  }
  response.set_content_provider(
      bytes, media_type, [stream](size_t offset, size_t length, httplib::DataSink& sink) {
        std::string piece(std::min(length, kPieceBytes), '\0');
        stream->clear();
        stream->seekg(static_cast<std::streamoff>(offset));
        stream->read(piece.data(), static_cast<std::streamsize>(piece.size()));
        const auto count = static_cast<size_t>(stream->gcount());
        return count > 0 && sink.write(piece.data(), count);
      });
}

void AddFilmRoutes(const FilmRouteParts& parts, const StudioRoutes& routes) {
  routes.get(ApiPattern("sets", "/film"), [parts](const Request& request, Response& response) {
    const PhotoFolder folder = parts.folder_of(request.matches[1]);
    AnswerJson(parts.frames.Describe(RequireFilm(folder)), response);
  });
  routes.get(
      ApiPattern("sets", "/film/frame"), [parts](const Request& request, Response& response) {
        const PhotoFolder folder = parts.folder_of(request.matches[1]);
        const std::string name = request.get_param_value("name");
        const bool gray = request.get_param_value("gray") == "1";
        response.set_content(parts.frames.Jpeg(RequireFilm(folder), name, SideOf(request), gray),
                             "image/jpeg");
      });
  routes.get(
      ApiPattern("sets", "/film/video"), [parts](const Request& request, Response& response) {
        const PhotoFolder folder = parts.folder_of(request.matches[1]);
        if (!folder.film) {
          throw Error(ErrorCode::kNotFound, "{} has pictures, and no video file", folder.Name());
        }
        AnswerFile(folder.film->file, MediaTypeOfFilm(folder.film->file), response);
      });
  routes.post(ApiPattern("sets", "/film/colorize"),
              [parts](const Request& request, Response& response, const ContentReader& body) {
                const std::string id = request.matches[1];
                const FilmChoices choices =
                    ReadFilmChoices(ReadJsonBody(request, body), id, parts.sets);
                RequireFilm(parts.folder_of(id));
                const FilmCalls films(parts.connection);
                AnswerJson(JobFacts(films.Colorize(parts.scene_of(id), choices)), response);
              });
  routes.post(ApiPattern("sets", "/film/frames"),
              [parts](const Request& request, Response& response, const ContentReader& body) {
                const auto json = ReadJsonBody(request, body);
                const auto value = json.find("are_frames");
                if (value == json.end() || !value->is_boolean()) {
                  throw InvalidArgument("are_frames is true or false");
                }
                parts.sets.SetAsFrames(request.matches[1], value->get<bool>());
                AnswerJson(SetJson(parts.sets.Get(request.matches[1])), response);
              });
  routes.get(ApiPattern("jobs", "/film"), [parts](const Request& request, Response& response) {
    AnswerJson(FilmCalls(parts.connection).Timeline(request.matches[1]), response);
  });
  routes.post(ApiPattern("jobs", "/film/change"),
              [parts](const Request& request, Response& response, const ContentReader& body) {
                const auto json = ReadJsonBody(request, body);
                const std::string set = TextOf(json, "set");
                const FilmChoices choices = ReadFilmChoices(json, set, parts.sets);
                const FilmCalls films(parts.connection);
                AnswerJson(JobFacts(films.Change(request.matches[1], choices)), response);
              });
  // A finished movie, and its frames for browsers that cannot play it.
  routes.get(ApiPattern("jobs", "/film/video"),
             [parts](const Request& request, Response& response) {
               AnswerFile(parts.fetch(request.matches[1], request.get_param_value("name")),
                          "video/mp4",
                          response);
             });
  routes.get(
      ApiPattern("jobs", "/film/frame"), [parts](const Request& request, Response& response) {
        const fs::path film = parts.fetch(request.matches[1], request.get_param_value("name"));
        const bool gray = request.get_param_value("gray") == "1";
        response.set_content(
            parts.frames.JpegOfFile(film, FrameNumberOf(request), SideOf(request), gray),
            "image/jpeg");
      });
}

}  // namespace color3d::client
