// Memory limit of workers: a job that needs more fails with the figures, other jobs continue.
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "core/base/files.h"
#include "tests/integration/service_fixture.h"
#include "tests/support/formats/flat_png.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kLimitBytes = int64_t{2} << 30;

class MemoryLimitTest : public ServiceTest {
 protected:
  void SetUp() override { StartServer({"--worker-memory-mib", "2048"}); }

  int WorkerPid() {
    const v1::ServerInfo info = server().Info();
    for (const v1::WorkerInfo& worker : info.workers()) {
      if (worker.worker_id().starts_with("worker-1-"))
        return std::stoi(worker.worker_id().substr(9));
    }
    return 0;
  }
  // Peak memory of the worker, bytes.
  int64_t PeakOf(int pid) const {
    std::ifstream status("/proc/" + std::to_string(pid) + "/status");
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("VmHWM:")) return std::stoll(line.substr(6)) * 1024;
    }
    return 0;
  }

  void ExpectOtherJobsGoOn() {
    ProceduralSceneOptions options = SmallRoom(4);
    options.width = 160;
    options.height = 120;
    options.poses = ProceduralSceneOptions::Poses::kColmap;
    WriteProceduralScene(Path("room"), options);
    const ProcessResult created = Client({"scene", "create", Path("room").string()});
    ASSERT_EQ(created.exit_code, 0) << created.err;
    v1::JobSpec spec;
    const size_t at = created.out.find("scenes/");
    ASSERT_NE(at, std::string::npos) << created.out;
    spec.set_scene(created.out.substr(at, created.out.find_first_of(" \n\",", at) - at));
    spec.mutable_import_scene();
    RunJob(spec);
  }
};

TEST_F(MemoryLimitTest, HugePhotosFailWithFiguresAndSpareOtherJobs) {
  ExpectOtherJobsGoOn();
  const int pid = WorkerPid();
  ASSERT_GT(pid, 0);
  int score = 0;
  std::ifstream("/proc/" + std::to_string(pid) + "/oom_score_adj") >> score;
  EXPECT_EQ(score, 500);
  fs::create_directory(Path("huge"));
  for (int i = 0; i < 4; ++i) {
    WriteFileAtomic(Path("huge") / ("wall" + std::to_string(i) + ".png"),
                    FlatPng(14'000, 14'000, 1, static_cast<char>(100 + i)));
  }
  const ProcessResult result =
      Client(std::vector<std::string>{
                 "colorize", Path("huge").string(), "-o", Path("out").string(), "--auto"} +
             QuickOptions());
  ExpectRefusal(result,
                4,
                {"wall0.png",
                 "14000 x 14000 px",
                 "MiB",
                 "are granted",
                 "reduce it to",
                 "--worker-memory-mib"});
  EXPECT_LT(PeakOf(pid), kLimitBytes);
  fs::remove_all(Path("room"));
  ExpectOtherJobsGoOn();
  EXPECT_EQ(WorkerPid(), pid) << "the worker was replaced";
}

// Small photos with a huge coloured picture.
TEST_F(MemoryLimitTest, HugeKeyPictureFailsWithFigures) {
  ExpectOtherJobsGoOn();
  const int pid = WorkerPid();
  WriteFileAtomic(Path("view001.png"), FlatPng(16'000, 12'000, 3, 100));
  const ProcessResult result = Client(std::vector<std::string>{"colorize",
                                                               Path("room").string(),
                                                               "-o",
                                                               Path("out").string(),
                                                               "--key-color",
                                                               Path("view001.png").string()} +
                                      QuickOptions());
  ExpectRefusal(result, 4, {"16000 x 12000 px", "MiB", "are granted", "--worker-memory-mib"});
  EXPECT_LT(PeakOf(pid), kLimitBytes);
  EXPECT_EQ(WorkerPid(), pid) << "the worker was replaced";
}

}  // namespace
}  // namespace color3d
