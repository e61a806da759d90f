#include "server/ops/json_lines.h"

#include <gtest/gtest.h>
#include <spdlog/logger.h>
#include <spdlog/sinks/ostream_sink.h>

#include <nlohmann/json.hpp>
#include <sstream>

namespace color3d {
namespace {

nlohmann::json Logged(const std::string& message) {
  std::ostringstream text;
  spdlog::logger logger("worker-1", std::make_shared<spdlog::sinks::ostream_sink_mt>(text));
  logger.set_formatter(MakeJsonLines());
  logger.info("{}", message);
  EXPECT_EQ(text.str().find('\n'), text.str().size() - 1) << "one line";
  return nlohmann::json::parse(text.str());
}

TEST(JsonLinesTest, TagsBecomeFields) {
  const nlohmann::json line = Logged("[job=jobs/ab12 attempt=1] begins");
  EXPECT_EQ(line.at("job"), "jobs/ab12");
  EXPECT_EQ(line.at("attempt"), "1");
  EXPECT_EQ(line.at("message"), "begins");
  EXPECT_EQ(line.at("from"), "worker-1");
  EXPECT_EQ(line.at("level"), "info");
  EXPECT_EQ(line.at("time").get<std::string>().size(), 24u);
}

TEST(JsonLinesTest, KeepsMessageInOneLine) {
  EXPECT_EQ(Logged("a \"b\"\n\t{\"job\": 1}").at("message"), "a \"b\"\n\t{\"job\": 1}");
  EXPECT_EQ(Logged("[not a tag] x").at("message"), "[not a tag] x");
  EXPECT_EQ(Logged("[=] x").at("message"), "[=] x");
  EXPECT_EQ(Logged("[message=lies] x").at("message"), "x");
  EXPECT_TRUE(Logged(std::string("\xff\xfe\0", 3)).at("message").is_string());
  EXPECT_EQ(Logged("").at("message"), "");
}

}  // namespace
}  // namespace color3d
