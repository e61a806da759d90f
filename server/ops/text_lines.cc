#include "server/ops/text_lines.h"

#include <fmt/format.h>

#include <string>
#include <string_view>

#include "core/base/text/utf8.h"
#include "server/ops/log_time.h"

namespace color3d {
namespace {

class TextLines : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& into) override {
    const spdlog::string_view_t level = spdlog::level::to_string_view(message.level);
    const std::string line = fmt::format(
        "{} {} {} {}\n",
        LogTime(message.time),
        std::string_view(level.data(), level.size()),
        std::string_view(message.logger_name.data(), message.logger_name.size()),
        EscapeControls(std::string_view(message.payload.data(), message.payload.size())));
    into.append(line.data(), line.data() + line.size());
  }
  std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<TextLines>();
  }
};

}  // namespace

std::unique_ptr<spdlog::formatter> MakeTextLines() { return std::make_unique<TextLines>(); }

}  // namespace color3d
