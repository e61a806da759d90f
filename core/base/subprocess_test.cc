#include "core/base/subprocess.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace {

TEST(Subprocess, ReportsExitCodeLogTimeoutAndCancellation) {
  ScratchFolder scratch;
  CancellationToken cancel;
  SubprocessOptions options;
  options.arguments = {"sh", "-c", "echo $COLOR3D_TEST; exit 3"};
  options.environment = {"COLOR3D_TEST=hello"};
  options.log_path = scratch.path() / "log";
  EXPECT_EQ(RunSubprocess(options, cancel).exit_code, 3);
  EXPECT_EQ(ReadFile(options.log_path), "hello\n");

  options.arguments = {"sh", "-c", "sleep 60 & wait"};
  options.timeout = std::chrono::seconds(0);
  EXPECT_TRUE(RunSubprocess(options, cancel).timed_out);

  options.timeout = std::chrono::seconds(60);
  cancel.Cancel();
  EXPECT_THROW(RunSubprocess(options, cancel), Error);

  options.arguments = {"color3d-no-such-program"};
  CancellationToken fresh;
  try {
    RunSubprocess(options, fresh);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kFailedPrecondition);
  }
}

}  // namespace
}  // namespace color3d
