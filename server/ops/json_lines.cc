#include "server/ops/json_lines.h"

#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <string_view>

#include "core/base/text/utf8.h"
#include "server/ops/log_time.h"

namespace color3d {
namespace {

// Removes the tag from the message and adds its fields. Returns false if there is no tag.
bool ParseTag(std::string_view* message, nlohmann::ordered_json* line) {
  const size_t end = message->find("] ");
  if (!message->starts_with('[') || end == std::string_view::npos) return false;
  std::istringstream words{std::string(message->substr(1, end - 1))};
  nlohmann::ordered_json fields = nlohmann::ordered_json::object();
  for (std::string word; words >> word;) {
    const size_t equals = word.find('=');
    if (equals == 0 || equals == std::string::npos) return false;
    fields[word.substr(0, equals)] = word.substr(equals + 1);
  }
  line->update(fields);
  *message = message->substr(end + 2);
  return true;
}

class JsonLines : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& into) override {
    const spdlog::string_view_t level = spdlog::level::to_string_view(message.level);
    const std::string clean =
        CleanUtf8(std::string(message.payload.data(), message.payload.size()));
    std::string_view text = clean;
    nlohmann::ordered_json line = {
        {"time", LogTime(message.time)},
        {"level", std::string(level.data(), level.size())},
        {"from", std::string(message.logger_name.data(), message.logger_name.size())}};
    ParseTag(&text, &line);
    line["message"] = std::string(text);
    // ASCII only, so that no control character reaches a terminal that shows the log.
    const std::string bytes =
        line.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) + "\n";
    into.append(bytes.data(), bytes.data() + bytes.size());
  }
  std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JsonLines>();
  }
};

}  // namespace

std::unique_ptr<spdlog::formatter> MakeJsonLines() { return std::make_unique<JsonLines>(); }

}  // namespace color3d
