#include "server/ops/job_log.h"

#include <gtest/gtest.h>
#include <spdlog/logger.h>

#include "core/base/files.h"

namespace color3d {
namespace {

TEST(JobLogTest, LinesOfJobGoToItsFile) {
  ScratchFolder scratch;
  spdlog::logger logger("test", MakeJobLogSink(scratch.path()));
  logger.info("[job=jobs/ab12 attempt=1] begins\nwith two \x1b[2Jlines");
  logger.warn("[job=jobs/cd34] of another");
  logger.info("of none");
  logger.info("[job=jobs/broken");
  const std::string text = ReadFile(JobLogFile(scratch.path(), "jobs/ab12"));
  EXPECT_TRUE(text.ends_with("Z info begins\\nwith two \\x1b[2Jlines\n")) << text;
  EXPECT_EQ(text.size(),
            std::string("2026-01-31T12:00:00.000Z info begins\\nwith two \\x1b[2Jlines\n").size());
  EXPECT_EQ(ListFiles(scratch.path()).size(), 2u);
}

TEST(JobLogTest, LimitsSizeOfFile) {
  ScratchFolder scratch;
  spdlog::logger logger("test", MakeJobLogSink(scratch.path()));
  const std::string line(1000, 'x');
  for (int i = 0; i < 1100; ++i) logger.info("[job=jobs/ab12 attempt=1] {}", line);
  const std::string text = ReadFile(JobLogFile(scratch.path(), "jobs/ab12"));
  EXPECT_NEAR(static_cast<double>(text.size()), 1 << 20, 2000.0);
  EXPECT_TRUE(text.ends_with("the log is full; further lines are in the log of the worker\n"));
}

}  // namespace
}  // namespace color3d
