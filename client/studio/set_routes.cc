#include "client/studio/set_routes.h"

#include <algorithm>

#include "client/studio/found_photos.h"
#include "client/studio/run_progress.h"
#include "client/studio/studio_answers.h"
#include "client/studio/studio_requests.h"
#include "core/base/error.h"
#include "core/base/text/lower_case.h"
#include "core/image/probe/probe.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

using httplib::ContentReader;
using httplib::Request;
using httplib::Response;
using Json = nlohmann::ordered_json;

constexpr int64_t kMaxPictureBytes = 256 << 20;

void ReceiveFile(const SetRouteParts& parts,
                 const Request& request,
                 Response& response,
                 const ContentReader& reader) {
  RequireLength(request, parts.max_file_bytes);
  const std::string name = request.get_param_value("name");
  int64_t received = 0;  // not announced in pieces, and more than announced where compressed
  const int64_t bytes =
      parts.sets.Receive(request.matches[1], name, [&](const PhotoSets::Sink& sink) {
        return reader([&](const char* piece, size_t count) {
          received += static_cast<int64_t>(count);
          return received <= parts.max_file_bytes && sink(piece, count);
        });
      });
  AnswerJson({{"name", name}, {"bytes", bytes}}, response);
}

void KeepPicture(const SetRouteParts& parts,
                 const Request& request,
                 Response& response,
                 const ContentReader& reader) {
  const std::string name = request.get_param_value("name");
  const std::string ending = LowerCase(fs::path(name).extension().string());
  if (!HasImageExtension(name)) {
    throw InvalidArgument("{} is not a picture: {} are read", name, ReadableImageFormats());
  }
  const std::string bytes = ReadBody(request, reader, kMaxPictureBytes);
  const ImageInfo info = ProbeImage(bytes, name);
  const fs::path file = parts.sets.KeepPicture(request.matches[1], ending, bytes);
  AnswerJson({{"picture", file.filename()}, {"width", info.width}, {"height", info.height}},
             response);
}

}  // namespace

void AddSetRoutes(const SetRouteParts& parts, const StudioRoutes& routes) {
  routes.post("/api/sets",
              [parts](const Request& request, Response& response, const ContentReader& body) {
                AnswerJson(SetJson(parts.sets.Create(TextOf(ReadJsonBody(request, body), "name"))),
                           response);
              });
  routes.get(ApiPattern("sets", ""), [parts](const Request& request, Response& response) {
    const PhotoSet set = parts.sets.Get(request.matches[1]);
    Json json = SetJson(set);
    try {
      json["found"] = DescribePhotos(CollectSet(set), parts.cancel);
    } catch (const Error& e) {  // no error of the call: the page says what is wrong with the files
      if (e.code() == ErrorCode::kCancelled) throw;
      json["problem"] = e.what();
    }
    AnswerJson(json, response);
  });
  routes.get(ApiPattern("sets", "/photo"), [parts](const Request& request, Response& response) {
    const PhotoFolder folder = parts.folder_of(request.matches[1]);
    const LocalFile photo = parts.films.File(folder, request.get_param_value("name"));
    const bool gray = request.get_param_value("gray") == "1";
    response.set_content(PhotoJpeg(photo, SideOf(request), gray), "image/jpeg");
  });
  routes.post(ApiPattern("sets", "/files"),
              [parts](const Request& request, Response& response, const ContentReader& body) {
                ReceiveFile(parts, request, response, body);
              });
  routes.post(ApiPattern("sets", "/pictures"),
              [parts](const Request& request, Response& response, const ContentReader& body) {
                KeepPicture(parts, request, response, body);
              });
  routes.post(ApiPattern("sets", "/plan"),
              [parts](const Request& request, Response& response, const ContentReader& body) {
                const std::string id = request.matches[1];
                const RunChoices choices = ReadChoices(ReadJsonBody(request, body), id, parts.sets);
                AnswerJson(parts.calls.Plan(parts.folder_of(id), choices), response);
              });
  routes.post(ApiPattern("sets", "/key"),
              [parts](const Request& request, Response& response, const ContentReader& body) {
                const int count = ReadJsonBody(request, body).value("count", 1);
                const std::string id = request.matches[1];
                const PhotoFolder folder = parts.folder_of(id);
                const size_t views = folder.film ? 5 : folder.photos.size();  // one for each shot
                const int most = std::max<int>(1, static_cast<int>(views));
                const v1::Job job = parts.calls.SelectKeyView(
                    parts.scene_of(id), std::clamp(count, 1, std::min(most, 5)));
                AnswerJson(JobFacts(job), response);
              });
  routes.post(ApiPattern("sets", "/preview"),
              [parts](const Request& request, Response& response, const ContentReader& body) {
                const auto json = ReadJsonBody(request, body);
                const std::string id = request.matches[1];
                const PhotoFolder folder = parts.folder_of(id);
                const int side = json.value("max_side", 1000);
                response.set_content(
                    parts.calls.Preview(parts.films.File(folder, TextOf(json, "photo")),
                                        ReadColor(json, id, parts.sets),
                                        TextOf(json, "made_by"),
                                        side == 0 ? 0 : std::clamp(side, 16, 2000)),
                    "image/png");
              });
  routes.post(ApiPattern("sets", "/below"),
              [parts](const Request& request, Response& response, const ContentReader& body) {
                const auto json = ReadJsonBody(request, body);
                const std::string id = request.matches[1];
                const ColorChoice color = ReadColor(json, id, parts.sets);
                AnswerJson(JobFacts(parts.calls.ColorBelow(
                               parts.scene_of(id), TextOf(json, "photo"), color)),
                           response);
              });
  routes.post(ApiPattern("sets", "/colorize"),
              [parts](const Request& request, Response& response, const ContentReader& body) {
                const std::string id = request.matches[1];
                const RunChoices choices = ReadChoices(ReadJsonBody(request, body), id, parts.sets);
                AnswerJson(JobFacts(parts.calls.Colorize(parts.scene_of(id), choices)), response);
              });
}

}  // namespace color3d::client
