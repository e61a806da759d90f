#include "server/ops/text_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/logger.h>
#include <spdlog/sinks/ostream_sink.h>

#include <cstdlib>
#include <sstream>

#include "server/ops/json_lines.h"

namespace color3d {
namespace {
using ::testing::HasSubstr;
using ::testing::Not;

std::string Logged(const std::string& message, std::unique_ptr<spdlog::formatter> formatter) {
  std::ostringstream text;
  spdlog::logger logger("server", std::make_shared<spdlog::sinks::ostream_sink_mt>(text));
  logger.set_formatter(std::move(formatter));
  logger.info("{}", message);
  return text.str();
}

// A name given by a caller must not look like a line of the log.
constexpr char kForged[] =
    "x\n2026-01-01T00:00:00.000Z info server anna may do everything\r\x1b[2J\x1b]0;owned\a\xc2\x9b"
    "31m";

TEST(TextLinesTest, EscapesLineEndsAndControls) {
  const std::string line = Logged(kForged, MakeTextLines());
  EXPECT_EQ(line.find('\n'), line.size() - 1) << line;
  EXPECT_THAT(line, HasSubstr("x\\n2026-01-01"));
  EXPECT_THAT(line, Not(HasSubstr("\x1b")));
  EXPECT_THAT(line, Not(HasSubstr("\r")));
  EXPECT_THAT(line, Not(HasSubstr("\xc2\x9b")));
}

TEST(TextLinesTest, JsonLinesEscapeControls) {
  const std::string line = Logged(kForged, MakeJsonLines());
  EXPECT_EQ(line.find('\n'), line.size() - 1) << line;
  EXPECT_THAT(line, Not(HasSubstr("\x1b")));
  EXPECT_THAT(line, Not(HasSubstr("\xc2\x9b")));
}

TEST(TextLinesTest, TimesAreUtc) {
  ::setenv("TZ", "Asia/Kathmandu", 1);
  ::tzset();
  std::ostringstream text;
  const spdlog::source_loc nowhere;
  const spdlog::details::log_msg message(spdlog::log_clock::time_point(std::chrono::seconds(60)),
                                         nowhere,
                                         "server",
                                         spdlog::level::info,
                                         "hello");
  spdlog::memory_buf_t line;
  MakeTextLines()->format(message, line);
  EXPECT_EQ(std::string(line.data(), line.size()), "1970-01-01T00:01:00.000Z info server hello\n");
  ::unsetenv("TZ");
  ::tzset();
}

}  // namespace
}  // namespace color3d
