#include "client/lib/text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace color3d::client {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Text, FormatsNumbers) {
  EXPECT_EQ(HumanBytes(0), "0 B");
  EXPECT_EQ(HumanBytes(999), "999 B");
  EXPECT_EQ(HumanBytes(1000), "1.0 kB");
  EXPECT_EQ(HumanBytes(3'210'000), "3.2 MB");
  EXPECT_EQ(HumanSeconds(0.44), "0.4 s");
  EXPECT_EQ(HumanSeconds(72.3), "72 s");
  EXPECT_EQ(HumanSeconds(3725), "1 h 02 min");
  EXPECT_EQ(HumanClock(9), "0:09");
  EXPECT_EQ(HumanClock(3723), "1:02:03");
}

v1::Job Running() {
  v1::Job job;
  job.set_kind("personalize");
  job.set_state(v1::Job::STATE_RUNNING);
  v1::Progress* progress = job.mutable_progress();
  progress->set_step(50);
  progress->set_total_steps(100);
  progress->set_message("training");
  progress->set_error_name("train_l1_ab");
  progress->set_error_value(3.21);
  progress->set_eta_seconds(65);
  return job;
}

TEST(Text, ProgressLineHasAllParts) {
  const std::string line = ProgressLine(Running(), 200);
  EXPECT_THAT(line, HasSubstr("personalize "));
  EXPECT_THAT(line, HasSubstr("[##########----------] 50/100"));
  EXPECT_THAT(line, HasSubstr("train_l1_ab=3.21"));
  EXPECT_THAT(line, HasSubstr("1:05 left"));
  EXPECT_THAT(line, HasSubstr("training"));
}

TEST(Text, ProgressLineHasNoteBeforeMessage) {
  EXPECT_THAT(ProgressLine(Running(), 200, "estimated error 2.4"),
              HasSubstr("1:05 left  estimated error 2.4  training"));
}

TEST(Text, ProgressLineFitsTerminal) {
  v1::Job job = Running();
  job.mutable_progress()->set_message("two\nlines \xe2\x82\xac\xe2\x82\xac\xe2\x82\xac");
  for (int width = 10; width < 120; ++width) {
    const std::string line = ProgressLine(job, width);
    EXPECT_LE(line.size(), static_cast<size_t>(width));
    EXPECT_THAT(line, Not(HasSubstr("\n")));
    EXPECT_NE(static_cast<unsigned char>(line.back()), 0xe2u);
  }
}

TEST(Text, ClampsProgressBar) {
  v1::Job job = Running();
  job.mutable_progress()->set_step(500);
  EXPECT_THAT(ProgressLine(job, 200), HasSubstr("[####################] 500/100"));
}

TEST(Text, FormatsEndLines) {
  v1::Job job = Running();
  job.mutable_progress()->set_seconds(12.3);
  job.set_state(v1::Job::STATE_SUCCEEDED);
  EXPECT_THAT(EndLine(job), HasSubstr("done in 12 s"));
  job.set_cached(true);
  EXPECT_THAT(EndLine(job), HasSubstr("(cached)"));
  job.set_state(v1::Job::STATE_SKIPPED);
  job.set_skip_reason("no truth");
  EXPECT_THAT(EndLine(job), HasSubstr("left out: no truth"));
  job.set_skip_reason("input jobs/1 failed: a long story");
  EXPECT_THAT(EndLine(job), EndsWith("left out: input jobs/1 failed"));
  job.set_state(v1::Job::STATE_FAILED);
  job.mutable_error()->set_message("it broke");
  EXPECT_THAT(EndLine(job), HasSubstr("failed after 12 s: it broke"));
  job.set_kind("colorize_scene");
  EXPECT_THAT(EndLine(job), HasSubstr("report "));
}

TEST(Text, ShellLineQuotesIfNeeded) {
  EXPECT_EQ(ShellLine({"color3d", "colorize", "my photos", "-o", "it's"}),
            "color3d colorize 'my photos' -o 'it'\\''s'");
  EXPECT_EQ(ShellLine({""}), "''");
}

TEST(Text, AlignsTables) {
  EXPECT_EQ(Table({{"NAME", "STATE"}, {"jobs/1", "X"}}), "NAME    STATE\njobs/1  X\n");
  EXPECT_EQ(Table({{"A"}, {"x\njobs/2\x1b[2J"}}), "A\nx\\njobs/2\\x1b[2J\n")
      << "control characters of names are escaped";
}

}  // namespace
}  // namespace color3d::client
