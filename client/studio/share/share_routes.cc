#include "client/studio/share/share_routes.h"

#include <fmt/core.h>

#include <memory>
#include <utility>

#include "client/options/credit_flags.h"
#include "client/studio/found_photos.h"
#include "client/studio/run_progress.h"
#include "client/studio/share/side_by_side.h"
#include "client/studio/studio_answers.h"
#include "client/studio/studio_requests.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/zip/zip.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

using httplib::ContentReader;
using httplib::Request;
using httplib::Response;
using Json = nlohmann::ordered_json;

constexpr char kCreditFile[] = "credit.json";
constexpr int64_t kMaxCreditBytes = 64 << 10;
constexpr size_t kMaxZipBytes = size_t{1} << 30;
constexpr int kPhotoQuality = 95;  // of JPEG
constexpr std::pair<const char*, std::string PictureCredit::*> kCreditFields[] = {
    {"colored_by", &PictureCredit::colored_by},
    {"key_view_by", &PictureCredit::key_view_by},
    {"source", &PictureCredit::source},
    {"licence", &PictureCredit::licence}};

Json CreditJson(const PictureCredit& credit) {
  Json json = Json::object();
  for (const auto& [name, field] : kCreditFields) json[name] = credit.*field;
  json["text"] = CreditText(credit);
  return json;
}

PictureCredit ParseCredit(const nlohmann::json& json) {
  PictureCredit credit;
  for (const auto& [name, field] : kCreditFields) credit.*field = TextOf(json, name);
  credit.Validate();
  return credit;
}

// The credit that was typed last; an empty one if there is none or its file is damaged.
PictureCredit KeptCredit(const fs::path& folder) {
  if (!IsFile(folder / kCreditFile)) return {};
  const auto json = nlohmann::json::parse(
      ReadFile(folder / kCreditFile, kMaxCreditBytes), nullptr, /*allow_exceptions=*/false);
  try {
    return json.is_object() ? ParseCredit(json) : PictureCredit();
  } catch (const Error&) {
    return {};
  }
}

MovieWish ReadWish(const nlohmann::json& json) {
  MovieWish wish;
  wish.path = TextOf(json, "path");
  const auto number = [&](const char* name) -> std::optional<double> {
    const auto value = json.find(name);
    if (value == json.end() || value->is_null()) return std::nullopt;
    if (!value->is_number()) throw InvalidArgument("{} is not a number", name);
    return value->get<double>();
  };
  wish.seconds = number("seconds");
  if (const auto side = number("max_side")) {
    if (!(*side >= 64 && *side <= 4096)) {
      throw InvalidArgument("max_side is {}; 64 to 4096 px are possible", *side);
    }
    wish.max_side_px = static_cast<int>(*side);
  }
  wish.bounce = FlagOf(json, "bounce");
  return wish;
}

std::string PlainName(const std::string& photo) { return fs::path(photo).stem().string(); }

class SharePages {
 public:
  SharePages(ShareParts parts, const ShareCalls& calls) : parts_(std::move(parts)), calls_(calls) {}

  Json Credit() const { return CreditJson(KeptCredit(parts_.folder)); }
  Json KeepCredit(const nlohmann::json& json) const {
    const PictureCredit credit = ParseCredit(json);
    std::error_code none;  // WriteFileAtomic tells
    fs::create_directories(parts_.folder, none);
    WriteFileAtomic(parts_.folder / kCreditFile, CreditJson(credit).dump(1) + "\n");
    return CreditJson(credit);
  }

  // A picture of a job with the credit.
  void SendPicture(const Request& request, Response& response) const {
    const std::string name = request.get_param_value("name");
    const auto [file, type] = parts_.fetched->Of(request.matches[1], name);
    const CreditFlags credit = CreditOf(request);
    response.set_content(WithCredit(ReadFile(file), credit, name), type);
    SetDownloadName(fs::path(name).filename().string(), response);
  }

  // A frame of a movie of a job with the credit.
  void SendFrame(const Request& request, Response& response) const {
    const fs::path movie = MovieOf(request);
    const int frame = FrameNumberOf(request);
    const std::string jpeg = parts_.frames->JpegOfFile(movie, frame, 0, /*gray=*/false);
    response.set_content(WithCredit(jpeg, CreditOf(request), "frame.jpg"), "image/jpeg");
    SetDownloadName(fmt::format("{}_frame_{:06}.jpg", PlainName(movie), frame), response);
  }

  // A photo of the user's in the colours of the scene: for the page, or to keep with the credit.
  void SendColored(const Request& request, Response& response) const {
    const PhotoFolder photos = parts_.photos_of(request.get_param_value("set"));
    const LocalFile& photo = PhotoOfView(photos, request.get_param_value("name"));
    const std::string job = request.matches[1];
    response.set_content(ColoredJpeg(job, photo, SideOf(request), CreditOf(request)), "image/jpeg");
    if (request.has_param("download")) {
      SetDownloadName(PlainName(photo.path) + "_coloured.jpg", response);
    }
  }

  // All of them.
  void SendZip(const Request& request, Response& response) const {
    const PhotoFolder photos = parts_.photos_of(request.get_param_value("set"));
    const std::string job = request.matches[1];
    std::vector<ZipEntry> entries;
    size_t bytes = 0;
    for (const LocalFile& photo : photos.photos) {
      parts_.cancel->ThrowIfCancelled();
      const std::string name =
          photo.path.starts_with("images/") ? photo.path.substr(7) : photo.path;
      entries.push_back({fs::path(name).replace_extension().string() + "_coloured.jpg",
                         ColoredJpeg(job, photo, SideOf(request), CreditOf(request))});
      bytes += entries.back().bytes.size();
      if (bytes > kMaxZipBytes) {
        throw Error(ErrorCode::kResourceExhausted,
                    "the photos are more than 1 GB together; choose a smaller size");
      }
    }
    if (entries.empty()) throw InvalidArgument("there are no photos; save the film instead");
    response.set_content(StoredZip(entries), "application/zip");
    SetDownloadName(photos.Name() + "_coloured.zip", response);
  }

  void SendSideBySide(const Request& request, Response& response) const {
    const fs::path movie = MovieOf(request);
    const ScratchFolder scratch(parts_.fetched->folder());
    const fs::path both = scratch.path() / "both.mp4";
    WriteSideBySide(movie, both, *parts_.cancel);
    response.set_content(ReadFile(both), "video/mp4");
    SetDownloadName("side_by_side.mp4", response);
  }

 private:
  fs::path MovieOf(const Request& request) const {
    const std::string name = request.get_param_value("name");
    if (!name.ends_with(".mp4")) throw InvalidArgument("the name of the movie is not possible");
    return parts_.fetched->Of(request.matches[1], name).file;
  }
  CreditFlags CreditOf(const Request& request) const {
    return {KeptCredit(parts_.folder), request.get_param_value("caption") == "1"};
  }
  std::string ColoredJpeg(const std::string& job,
                          const LocalFile& photo,
                          int side,
                          const CreditFlags& credit) const {
    const std::string png = calls_.ColoredPhoto(job, photo, side);
    const std::string jpeg = EncodeJpeg(DecodeImage(png, photo.path), kPhotoQuality);
    return WithCredit(jpeg, credit, "photo.jpg");
  }

  const ShareParts parts_;
  const ShareCalls& calls_;
};

}  // namespace

void AddShareRoutes(const StudioRoutes& routes, const ShareParts& parts, const ShareCalls& calls) {
  const auto pages = std::make_shared<const SharePages>(parts, calls);
  routes.get("/api/credit", [pages](const Request&, Response& response) {
    AnswerJson(pages->Credit(), response);
  });
  routes.post("/api/credit",
              [pages](const Request& request, Response& response, const ContentReader& body) {
                AnswerJson(pages->KeepCredit(ReadJsonBody(request, body)), response);
              });
  routes.post(ApiPattern("jobs", "/movie"),
              [&calls](const Request& request, Response& response, const ContentReader& body) {
                const MovieWish wish = ReadWish(ReadJsonBody(request, body));
                AnswerJson(JobFacts(calls.MakeMovie(request.matches[1], wish)), response);
              });
  routes.post(ApiPattern("jobs", "/file"),
              [&calls](const Request& request, Response& response, const ContentReader& body) {
                const std::string format = TextOf(ReadJsonBody(request, body), "format");
                AnswerJson(JobFacts(calls.MakeFile(request.matches[1], format)), response);
              });
  const auto send = [&](const char* what,
                        void (SharePages::*answer)(const Request&, Response&) const) {
    routes.get(ApiPattern("jobs", what),
               [pages, answer](const Request& request, Response& response) {
                 ((*pages).*answer)(request, response);
               });
  };
  send("/picture", &SharePages::SendPicture);
  send("/film/picture", &SharePages::SendFrame);
  send("/colored", &SharePages::SendColored);
  send("/colored\\.zip", &SharePages::SendZip);
  send("/side-by-side", &SharePages::SendSideBySide);
}

}  // namespace color3d::client
