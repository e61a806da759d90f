#include "core/scene/sfm/colmap_process.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/process/sandbox.h"
#include "tests/support/quiet_run.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;

// A script replaces COLMAP, which cannot be made to fail on demand.
class ColmapProcessTest : public testing::Test {
 protected:
  ColmapProcessTest() {
    const char* path = std::getenv("PATH");
    before_ = path != nullptr ? path : "";
    ::setenv("PATH", (scratch_.path().string() + ":" + before_).c_str(), 1);
  }
  ~ColmapProcessTest() override { ::setenv("PATH", before_.c_str(), 1); }

  int Run(const std::string& script) {
    const fs::path program = scratch_.path() / "colmap";
    std::ofstream(program) << "#!/bin/sh\n" << script << "\n";
    fs::permissions(program, fs::perms::owner_all);
    ColmapProcess colmap(scratch_.path() / "log.txt", std::chrono::seconds(60), run_.control());
    return colmap.Run({"mapper"}, {"placing cameras", "Registering image", 3});
  }

  ScratchFolder scratch_;
  QuietRun run_;
  std::string before_;
};

TEST_F(ColmapProcessTest, ReturnsExitCode) {
  EXPECT_EQ(Run("exit 0"), 0);
  EXPECT_EQ(Run("exit 3"), 3);
}

TEST_F(ColmapProcessTest, ThrowsWhenKilledBySignal) {
  for (const char* signal : {"KILL", "ABRT", "TERM"}) {
    try {
      Run(std::string("kill -") + signal + " $$");
      FAIL() << signal;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kUnavailable) << signal;
      EXPECT_NE(std::string(e.what()).find("colmap mapper"), std::string::npos) << e.what();
    }
  }
}

TEST_F(ColmapProcessTest, NamesMemoryLimitWhenExhausted) {
  try {
    Run("echo \"terminate called after throwing an instance of 'std::bad_alloc'\" >&2\n"
        "echo '*** Aborted' >&2\nkill -ABRT $$");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kResourceExhausted);
    EXPECT_NE(std::string(e.what()).find("MiB that it may take"), std::string::npos) << e.what();
  }
}

TEST_F(ColmapProcessTest, SeesNoTokenAndWritesBesideLogOnly) {
  ::setenv("COLOR3D_TOKEN", "secret", 1);
  EXPECT_EQ(Run("test -z \"$COLOR3D_TOKEN\""), 0);
  ::unsetenv("COLOR3D_TOKEN");
  if (!Sandbox(SandboxRules()).missing().empty()) GTEST_SKIP() << "not on this machine";
  const ScratchFolder other;
  EXPECT_EQ(Run("echo in > '" + (scratch_.path() / "in").string() + "'"), 0);
  EXPECT_NE(Run("echo out > '" + (other.path() / "out").string() + "'"), 0);
  SetSandboxing(false);
  EXPECT_EQ(Run("echo out > '" + (other.path() / "out").string() + "'"), 0);
  SetSandboxing(true);
}

TEST_F(ColmapProcessTest, NamesFileSizeLimitWhenExceeded) {
  try {
    Run("kill -XFSZ $$");
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("it wrote a file of more than 16384 MiB"),
              std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace color3d
