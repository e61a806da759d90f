#include "tests/support/service/processes.h"

#include <gtest/gtest.h>
#include <signal.h>

#include "core/base/files.h"

namespace color3d {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(Processes, CapturesOutputAndExitCode) {
  const ScratchFolder folder;
  const ProcessResult result =
      RunProcess({"sh", "-c", "echo seen; echo wrong >&2; exit 3"}, folder.path(), seconds(20));
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(result.out, "seen\n");
  EXPECT_EQ(result.err, "wrong\n");
  EXPECT_FALSE(result.timed_out);
}

TEST(Processes, MissingProgramIsExitCode127) {
  const ScratchFolder folder;
  EXPECT_EQ(RunProcess({"/no/such/program"}, folder.path(), seconds(20)).exit_code, 127);
}

TEST(Processes, TimeLimitKillsAllDescendants) {
  const ScratchFolder folder;
  // The grandchild leaves the process group, as a supervisor's workers may.
  Process process({"sh", "-c", "setsid sleep 300 & sleep 300"}, folder.path());
  ASSERT_TRUE(WaitUntil([&] { return Descendants(process.pid()).size() == 2; }, seconds(20)));
  const std::vector<pid_t> family = Descendants(process.pid());
  EXPECT_EQ(process.Wait(milliseconds(50)), std::nullopt);
  process.Kill();
  EXPECT_EQ(process.Wait(seconds(5)), 128 + SIGKILL);
  for (pid_t pid : family) {
    EXPECT_TRUE(WaitUntil([&] { return !IsAlive(pid); }, seconds(5))) << pid;
  }
}

}  // namespace
}  // namespace color3d
