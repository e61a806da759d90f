// A whole run with the files in an object store: real server, worker and client.
#include <gtest/gtest.h>

#include "core/base/digest.h"
#include "tests/integration/service_fixture.h"
#include "tests/support/service/s3_process.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using testing::S3Process;
using testing::S3rverProcess;

class ObjectStoreTest : public ServiceTest {
 protected:
  // Colours a room, restarts the server without its cache and downloads the results.
  void ColorAndReadBack(const S3Options& store, const fs::path& key) {
    const std::vector<std::string> flags{"--blobs",
                                         store.target.Name(),
                                         "--s3-endpoint",
                                         store.target.Endpoint(),
                                         "--s3-credentials-file",
                                         key};
    WriteProceduralScene(Path("room"), SmallRoom());
    StartServer(flags);
    const ProcessResult colored = Client(
        std::vector<std::string>{"colorize", Path("room"), "-o", Path("first"), "--benchmark"} +
        QuickOptions());
    ASSERT_EQ(colored.exit_code, 0) << colored.err;
    const v1::Job job = NewestJob("colorize_scene");
    StopServer();
    EXPECT_GT(fs::remove_all(Path("server") / "data" / "blob-cache"), 1u) << "nothing was cached";
    StartServer(flags);
    const ProcessResult fetched =
        Client({"artifact", "download", job.name(), "-o", Path("second")});
    ASSERT_EQ(fetched.exit_code, 0) << fetched.err;
    EXPECT_GE(job.artifacts_size(), 6);
    for (const v1::Artifact& artifact : job.artifacts()) {
      EXPECT_EQ(DigestFile(Path("second") / artifact.name()).sha256, artifact.digest().sha256())
          << artifact.name();
    }
    EXPECT_EQ(server().Stop(), 0);
    const ProcessResult fsck = RunProcess(
        std::vector<std::string>{ServerProgram(), "fsck", "--data-dir", Path("server") / "data"} +
            flags,
        Path("fsck"),
        std::chrono::seconds(120));
    EXPECT_EQ(fsck.exit_code, 0) << fsck.out << fsck.err;
  }
};

TEST_F(ObjectStoreTest, ColorsAndReadsBackAfterRestart) {
  if (!S3Process::IsInstalled()) GTEST_SKIP() << "NOT TESTED: python3 is missing";
  const S3Process store(folder_.path());
  ColorAndReadBack(store.Options("lab"), store.KeyFile(folder_.path()));
}

TEST_F(ObjectStoreTest, ColorsAndReadsBackFromS3rver) {
  if (S3rverProcess::Program().empty()) {
    GTEST_SKIP() << "NOT TESTED: npm install --prefix tests/.npm s3rver";
  }
  const S3rverProcess store(folder_.path());
  ColorAndReadBack(store.Options(), store.KeyFile(folder_.path()));
}

}  // namespace
}  // namespace color3d
