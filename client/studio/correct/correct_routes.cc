#include "client/studio/correct/correct_routes.h"

#include "client/studio/run_progress.h"
#include "client/studio/studio_answers.h"
#include "client/studio/studio_requests.h"
#include "core/base/error.h"

namespace color3d::client {
namespace {

using httplib::ContentReader;
using httplib::Request;
using httplib::Response;

constexpr size_t kMaxNameBytes = 1024;

std::string CorrectPattern(const std::string& after) {
  return "/api/jobs/([0-9a-f-]{1,64})/correct" + after;
}

std::string ViewOf(const Request& request) {
  const std::string name = request.get_param_value("view");
  if (name.empty() || name.size() > kMaxNameBytes) throw InvalidArgument("view names no photo");
  return name;
}

Corrections::Map MapOf(const Request& request) {
  const std::string map = request.get_param_value("map");
  if (map == "color") return Corrections::Map::kColor;
  if (map == "base") return Corrections::Map::kBase;
  if (map == "source") return Corrections::Map::kSource;
  if (map == "pull") return Corrections::Map::kPull;
  throw InvalidArgument("map is color, base, source or pull");
}

std::string TrialOf(const Request& request) {
  const std::string trial = request.get_param_value("trial");
  if (trial.size() > 64 || trial.find_first_not_of("0123456789abcdef-") != trial.npos) {
    throw InvalidArgument("trial is not the id of a job");
  }
  return trial;
}

}  // namespace

void AddCorrectRoutes(Corrections& corrections, const StudioRoutes& routes) {
  routes.get(CorrectPattern(""), [&corrections](const Request& request, Response& response) {
    AnswerJson(corrections.Describe(request.matches[1]), response);
  });
  routes.get(CorrectPattern("/photo"), [&corrections](const Request& request, Response& response) {
    response.set_content(
        corrections.PhotoJpeg(request.matches[1], ViewOf(request), SideOf(request)), "image/jpeg");
  });
  routes.get(CorrectPattern("/map"), [&corrections](const Request& request, Response& response) {
    response.set_content(
        corrections.MapPng(
            request.matches[1], TrialOf(request), MapOf(request), ViewOf(request), SideOf(request)),
        "image/png");
  });
  routes.post(
      CorrectPattern("/try"),
      [&corrections](const Request& request, Response& response, const ContentReader& body) {
        AnswerJson(JobFacts(corrections.Try(request.matches[1], ReadJsonBody(request, body))),
                   response);
      });
  routes.post(
      CorrectPattern(""),
      [&corrections](const Request& request, Response& response, const ContentReader& body) {
        AnswerJson(JobFacts(corrections.Change(request.matches[1], ReadJsonBody(request, body))),
                   response);
      });
  routes.get(CorrectPattern("/events"),
             [&corrections, stream = routes.stream](const Request& request, Response& response) {
               const std::string run = request.matches[1];
               corrections.Describe(run);  // refused while the status can still be sent
               stream(response, [&corrections, run](const StudioRoutes::Send& send) {
                 corrections.Watch(run, send);
               });
             });
}

}  // namespace color3d::client
