#include "client/studio/studio.h"

#include <fmt/core.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <optional>
#include <thread>
#include <utility>

#include "client/lib/names.h"
#include "client/lib/photos/photo_folder.h"
#include "client/studio/correct/correct_routes.h"
#include "client/studio/fetched_files.h"
#include "client/studio/film/film_frames.h"
#include "client/studio/film/film_routes.h"
#include "client/studio/found_photos.h"
#include "client/studio/page_files.h"
#include "client/studio/photo_sets.h"
#include "client/studio/queue/queue_routes.h"
#include "client/studio/run_progress.h"
#include "client/studio/set_routes.h"
#include "client/studio/share/share_routes.h"
#include "client/studio/studio_answers.h"
#include "client/studio/studio_calls.h"
#include "client/studio/studio_guard.h"
#include "client/studio/studio_requests.h"
#include "client/studio/studio_routes.h"
#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

using httplib::ContentReader;
using httplib::Request;
using httplib::Response;
using Json = nlohmann::ordered_json;
using Steady = std::chrono::steady_clock;

constexpr int kMaxEventStreams = 8;

// Counts event streams, so that they leave threads for other requests.
class StreamPlace {
 public:
  explicit StreamPlace(std::atomic<int>* count) : count_(count) {
    if (++*count_ <= kMaxEventStreams) return;
    --*count_;
    throw Error(ErrorCode::kUnavailable, "too many pages of the studio are open; close one");
  }
  ~StreamPlace() { --*count_; }
  StreamPlace(const StreamPlace&) = delete;
  StreamPlace& operator=(const StreamPlace&) = delete;

 private:
  std::atomic<int>* count_;
};

}  // namespace

class Studio::Parts {
 public:
  Parts(const StudioOptions& options, const CancellationToken& cancel);

  void AddRoutes();
  void Serve(const std::function<void(bool entered)>& look);

  const StudioOptions options_;
  const CancellationToken& cancel_;
  HttpServer http_;
  const int port_;
  std::optional<StudioGuard> guard_;
  PhotoSets sets_;
  SharedConnection connection_;
  StudioCalls calls_{connection_};
  ShareCalls share_{connection_};
  QueueCalls queue_{connection_};
  Corrections corrections_{connection_};
  FilmFrames films_;
  FetchedFiles fetched_{calls_};
  std::atomic<int> streams_{0};
  std::atomic<Steady::time_point> last_request_{Steady::now()};

 private:
  using Handler = StudioRoutes::Handler;
  using BodyHandler = StudioRoutes::BodyHandler;

  void Get(const std::string& pattern, Handler handler);
  void Post(const std::string& pattern, BodyHandler handler);
  void AddPageRoutes();
  void AddJobRoutes();

  void Open(const Request& request, Response& response);
  void StreamEvents(const Request& request, Response& response);
  // Answers with the states that `watch` passes to `send` as events.
  void Stream(Response& response, std::function<void(const StudioRoutes::Send& send)> watch);
  void SendArtifact(const Request& request, Response& response);

  PhotoFolder FolderOf(const std::string& id) const { return CollectSet(sets_.Get(id)); }
  // "scenes/..." of the set, uploaded if it is not there yet.
  std::string SceneOf(const std::string& id);
};

Studio::Parts::Parts(const StudioOptions& options, const CancellationToken& cancel)
    : options_(options),
      cancel_(cancel),
      http_(options.http),
      port_(http_.Bind(options.port)),
      sets_(options.folder),
      connection_(options.server, cancel),
      films_(cancel) {
  if (port_ < 0) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot listen on port {} of this machine; name another with --port",
                options.port);
  }
  guard_.emplace(port_);
  http_.set_pre_routing_handler([this](const Request& request, Response& response) {
    StudioGuard::Verdict verdict = guard_->CheckOrigin(request);
    if (verdict.status == 200 && request.path != "/open") verdict = guard_->CheckCookie(request);
    if (verdict.status == 200) {
      last_request_ = Steady::now();
      return httplib::Server::HandlerResponse::Unhandled;
    }
    AnswerError(verdict.status, "PERMISSION_DENIED", verdict.reason, response);
    return httplib::Server::HandlerResponse::Handled;
  });
  http_.set_post_routing_handler(
      [](const Request&, Response& response) { AddSafetyHeaders(response); });
  http_.set_error_handler([](const Request&, Response& response) {
    if (response.body.empty()) {
      AnswerError(response.status, "NOT_FOUND", "the studio has nothing at this address", response);
    }
  });
}

void Studio::Parts::Get(const std::string& pattern, Handler handler) {
  http_.Get(pattern, [handler = std::move(handler)](const Request& request, Response& response) {
    try {
      handler(request, response);
    } catch (const std::exception& e) {
      AnswerException(e, response);
    }
  });
}

void Studio::Parts::Post(const std::string& pattern, BodyHandler handler) {
  http_.Post(pattern,
             [handler = std::move(handler)](
                 const Request& request, Response& response, const ContentReader& reader) {
               try {
                 handler(request, response, reader);
               } catch (const std::exception& e) {
                 AnswerException(e, response);
               }
             });
}

void Studio::Parts::AddRoutes() {
  http_.set_payload_max_length(static_cast<size_t>(options_.max_file_bytes));
  AddPageRoutes();
  AddJobRoutes();
  const StudioRoutes routes{
      [this](const std::string& pattern, Handler handler) { Get(pattern, std::move(handler)); },
      [this](const std::string& pattern, BodyHandler handler) {
        Post(pattern, std::move(handler));
      },
      [this](Response& response, std::function<void(const StudioRoutes::Send&)> watch) {
        Stream(response, std::move(watch));
      }};
  const auto folder_of = [this](const std::string& set) { return FolderOf(set); };
  const auto scene_of = [this](const std::string& set) { return SceneOf(set); };
  AddSetRoutes({sets_, calls_, films_, cancel_, options_.max_file_bytes, folder_of, scene_of},
               routes);
  AddShareRoutes(routes, {options_.folder, folder_of, &fetched_, &films_, &cancel_}, share_);
  AddQueueRoutes(routes, queue_);
  AddCorrectRoutes(corrections_, routes);
  AddFilmRoutes({sets_,
                 connection_,
                 films_,
                 folder_of,
                 scene_of,
                 [this](const std::string& job, const std::string& name) {
                   return fetched_.Of(job, name).file;
                 }},
                routes);
}

void Studio::Parts::AddPageRoutes() {
  Get("/open", [this](const Request& request, Response& response) { Open(request, response); });
  Get("/(studio\\.css|studio\\.js)?", [](const Request& request, Response& response) {
    const PageFile* file = FindPageFile(request.path);
    response.set_content(file->bytes.data(), file->bytes.size(), file->media_type);
  });
  // Pages ask every half minute, so that a studio ends when the last one has been closed.
  Get("/api/alive",
      [](const Request&, Response& response) { AnswerJson(Json::object(), response); });
  Get("/api/state", [this](const Request&, Response& response) {
    Json sets = Json::array();
    for (const PhotoSet& set : sets_.List()) sets.push_back(SetJson(set));
    AnswerJson({{"server", calls_.ServerFacts()}, {"sets", sets}, {"jobs", calls_.Jobs()}},
               response);
  });
}

void Studio::Parts::AddJobRoutes() {
  Get("/api/jobs", [this](const Request&, Response& response) {
    AnswerJson({{"jobs", calls_.Jobs()}}, response);
  });
  Get(ApiPattern("jobs", ""), [this](const Request& request, Response& response) {
    AnswerJson(JobFacts(calls_.Job(request.matches[1])), response);
  });
  Get(ApiPattern("jobs", "/key-views"), [this](const Request& request, Response& response) {
    AnswerJson(calls_.KeyViews(request.matches[1]), response);
  });
  const auto change = [this](const char* what,
                             v1::Job (StudioCalls::*call)(const std::string&) const) {
    Post(ApiPattern("jobs", what),
         [this, call](const Request& request, Response& response, const ContentReader& body) {
           ReadJsonBody(request, body);
           AnswerJson(JobFacts((calls_.*call)(request.matches[1])), response);
         });
  };
  change("/cancel", &StudioCalls::Cancel);
  change("/retry", &StudioCalls::Retry);
  Get(ApiPattern("jobs", "/events"),
      [this](const Request& request, Response& response) { StreamEvents(request, response); });
  Get(ApiPattern("jobs", "/artifact"),
      [this](const Request& request, Response& response) { SendArtifact(request, response); });
  Get(ApiPattern("jobs", "/preview"), [this](const Request& request, Response& response) {
    const PhotoFolder folder = FolderOf(request.get_param_value("set"));
    const LocalFile photo = films_.File(folder, request.get_param_value("name"));
    response.set_content(calls_.PreviewOfRun(request.matches[1], photo, SideOf(request)),
                         "image/png");
  });
}

void Studio::Parts::Open(const Request& request, Response& response) {
  const std::string cookie = guard_->Exchange(request.get_param_value("token"));
  // A browser that is in already may open the address again.
  if (cookie.empty() && guard_->CheckCookie(request).status != 200) {
    return AnswerError(403, "PERMISSION_DENIED", guard_->CheckCookie(request).reason, response);
  }
  if (!cookie.empty()) response.set_header("Set-Cookie", cookie);
  // By a page in place of a redirection: after the latter, browsers that come from another program
  // leave out cookies of SameSite=Strict.
  std::string page = request.get_param_value("page");
  if (page.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789/-") != page.npos) page.clear();
  response.set_header("Refresh", "0; url=/#" + page);
  response.set_content("<!doctype html><link rel=icon href=data:,><title>Color3D</title>",
                       "text/html; charset=utf-8");
}

std::string Studio::Parts::SceneOf(const std::string& id) {
  // Uploaded again each time: what is there already is not sent, and a changed folder is another
  // scene.
  std::string scene = calls_.Upload(FolderOf(id));
  sets_.SetScene(id, scene);
  return scene;
}

void Studio::Parts::StreamEvents(const Request& request, Response& response) {
  const std::string job = request.matches[1];
  calls_.Job(job);  // an unknown one is refused while the status can still be sent
  Stream(response, [this, job](const StudioRoutes::Send& send) { calls_.Watch(job, send); });
}

void Studio::Parts::Stream(Response& response,
                           std::function<void(const StudioRoutes::Send& send)> watch) {
  const auto place = std::make_shared<StreamPlace>(&streams_);
  response.set_header("X-Accel-Buffering", "no");
  response.set_chunked_content_provider(
      "text/event-stream",
      [this, watch = std::move(watch), place](size_t, httplib::DataSink& sink) {
        const auto send = [&](const std::string& text) {
          const std::string event = text.empty() ? ": still here\n\n" : "data: " + text + "\n\n";
          return !http_.is_stopping() && sink.is_writable() &&
                 sink.write(event.data(), event.size());
        };
        try {
          watch(send);
          const std::string end = "event: end\ndata: {}\n\n";
          sink.write(end.data(), end.size());
        } catch (const std::exception& e) {
          const std::string problem = "event: problem\ndata: " + Json(e.what()).dump() + "\n\n";
          sink.write(problem.data(), problem.size());
        }
        sink.done();
        return true;
      });
}

void Studio::Parts::SendArtifact(const Request& request, Response& response) {
  const std::string name = request.get_param_value("name");
  const auto [file, type] = fetched_.Of(request.matches[1], name);
  if (request.has_param("download")) {
    SetDownloadName(fs::path(name).filename().string(), response);
  } else if (type == "text/html") {
    return AnswerSandboxed(ReadFile(file), response);
  }
  AnswerFile(file, type, response);
}

void Studio::Parts::Serve(const std::function<void(bool entered)>& look) {
  std::thread listener([this] { http_.listen_after_bind(); });
  last_request_ = Steady::now();
  const auto is_left = [&] {
    return options_.idle_exit.count() > 0 && streams_ == 0 &&
           Steady::now() - last_request_.load() > options_.idle_exit;
  };
  while (!cancel_.IsCancelled() && !is_left()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    if (look) look(guard_->is_used());
  }
  // stop() before listen_after_bind() has begun would be lost.
  while (!http_.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  http_.Stop();
  listener.join();
}

Studio::Studio(const StudioOptions& options, const CancellationToken& cancel)
    : parts_(std::make_unique<Parts>(options, cancel)) {
  parts_->AddRoutes();
}

Studio::~Studio() = default;

std::string Studio::OfferPhotos(const fs::path& path) {
  const PhotoSet set = parts_->sets_.Adopt(path);
  CollectSet(set);  // what cannot be used is said before the browser opens
  return "set/" + set.id;
}

std::string Studio::PageOfJob(const std::string& job) { return "job/" + IdOf(job); }

std::string Studio::Address(const std::string& page) const {
  return fmt::format("http://127.0.0.1:{}/open?token={}{}{}",
                     parts_->port_,
                     parts_->guard_->token(),
                     page.empty() ? "" : "&page=",
                     page);
}

int Studio::port() const { return parts_->port_; }

void Studio::Serve(const std::function<void(bool entered)>& look) { parts_->Serve(look); }

}  // namespace color3d::client
