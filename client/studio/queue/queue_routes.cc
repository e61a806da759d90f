#include "client/studio/queue/queue_routes.h"

#include "client/studio/studio_answers.h"
#include "core/base/error.h"

namespace color3d::client {
namespace {

using httplib::ContentReader;
using httplib::Request;
using httplib::Response;

std::vector<std::string> ReadOrder(const nlohmann::json& json) {
  const auto order = json.find("order");
  if (order == json.end() || !order->is_array()) throw InvalidArgument("order is not a list");
  std::vector<std::string> ids;
  for (const nlohmann::json& id : *order) {
    if (!id.is_string()) throw InvalidArgument("order is not a list of runs");
    ids.push_back(id.get<std::string>());
  }
  return ids;
}

}  // namespace

void AddQueueRoutes(const StudioRoutes& routes, QueueCalls& calls) {
  routes.get("/api/queue", [&calls](const Request&, Response& response) {
    AnswerJson({{"runs", calls.List()}}, response);
  });
  routes.post("/api/queue",
              [&calls](const Request& request, Response& response, const ContentReader& body) {
                const auto order = ReadOrder(ReadJsonBody(request, body));
                AnswerJson({{"moved", calls.Reorder(order)}}, response);
              });
  routes.get(ApiPattern("jobs", "/moved"), [&calls](const Request& request, Response& response) {
    AnswerJson({{"to", calls.MovedTo(request.matches[1])}}, response);
  });
}

}  // namespace color3d::client
