// Wrong options, key colours and environments are refused with a message of one line.
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <fstream>

#include "core/image/codec.h"
#include "tests/integration/service_fixture.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

constexpr seconds kLimit{150};

class BadRequestsTest : public ServiceTest {
 protected:
  fs::path GrayRoom() {
    ProceduralSceneOptions options = SmallRoom(4, /*gray=*/true);
    options.width = 160;
    options.height = 120;
    WriteProceduralScene(Path("room"), options);
    return Path("room");
  }

  ProcessResult Colorize(const std::vector<std::string>& more) {
    return Client(
        std::vector<std::string>{"colorize", Path("room").string(), "-o", Path("out").string()} +
            QuickOptions() + more,
        kLimit);
  }

  // Starts a second server that must refuse to start.
  ProcessResult Serve(const std::vector<std::string>& arguments) {
    return RunProcess(
        std::vector<std::string>{ServerProgram(), "serve", "--workers", "0"} + arguments,
        Path("second"),
        seconds(60));
  }
};

TEST_F(BadRequestsTest, RefusesKeyColorOfAnotherSize) {
  StartServer();
  GrayRoom();
  const Image truth = ReadImage(Path("room") / "truth" / "view002.png");
  WriteFileAtomic(Path("small.png"), EncodePng8(Resize(truth, 100, 75)));
  ExpectRefusal(Colorize({"--key-view", "view002", "--key-color", Path("small.png").string()}),
                2,
                {"100x75", "160x120"});
}

TEST_F(BadRequestsTest, RefusesKeyColorWithoutColor) {
  StartServer();
  const fs::path room = GrayRoom();
  ExpectRefusal(
      Colorize(
          {"--key-view", "view002", "--key-color", (room / "images" / "view002.png").string()}),
      2,
      {"no colour"});
}

TEST_F(BadRequestsTest, RefusesKeyColorThatIsNoImage) {
  StartServer();
  GrayRoom();
  WriteFileAtomic(Path("text.png"), "not a picture");
  ExpectRefusal(Colorize({"--key-color", Path("text.png").string()}), 2, {"text.png"});
}

TEST_F(BadRequestsTest, RefusesHintsOutsideThePicture) {
  StartServer();
  GrayRoom();
  WriteFileAtomic(Path("hints.json"), R"([{"x": 5000, "y": 20, "radius": 3, "color": "#ff0000"}])");
  ExpectRefusal(
      Colorize({"--key-view", "view001", "--hints", Path("hints.json").string()}), 2, {"hint"});
}

TEST_F(BadRequestsTest, RefusesEmptyHints) {
  StartServer();
  GrayRoom();
  WriteFileAtomic(Path("hints.json"), "[]");
  ExpectRefusal(
      Colorize({"--key-view", "view001", "--hints", Path("hints.json").string()}), 2, {"hint"});
}

TEST_F(BadRequestsTest, RefusesUnknownKeyView) {
  StartServer();
  GrayRoom();
  ExpectRefusal(Colorize({"--key-view", "view099"}), 2, {"view099"});
}

TEST_F(BadRequestsTest, RefusesUnknownPreset) {
  StartServer();
  GrayRoom();
  ExpectRefusal(Colorize({"--preset", "heroic"}), 2, {"heroic"});
}

TEST_F(BadRequestsTest, RefusesOptionOutOfRange) {
  StartServer();
  GrayRoom();
  ExpectRefusal(Colorize({"--max-side", "3"}), 2, {"64"});
}

TEST_F(BadRequestsTest, RefusesTimeBudgetTooShort) {
  StartServer();
  ExpectRefusal(Client({"colorize",
                        GrayRoom().string(),
                        "-o",
                        Path("out").string(),
                        "--key-view",
                        "view002",
                        "--key-color",
                        (Path("room") / "truth" / "view002.png").string(),
                        "--time-budget",
                        "12s"},
                       kLimit),
                2,
                {"time_budget_seconds is 12", "4 photos", "give at least"});
}

TEST_F(BadRequestsTest, RefusesUnreadableTimeBudget) {
  StartServer();
  GrayRoom();
  ExpectRefusal(Colorize({"--time-budget", "soon"}), 2, {"soon"});
}

TEST_F(BadRequestsTest, NamesUnreachableServer) {
  GrayRoom();
  // No server listens on port 1.
  const ProcessResult result = Colorize({"--server", "127.0.0.1:1"});
  ExpectRefusal(result, 3, {"127.0.0.1:1"});
  EXPECT_LT(result.seconds, 30.0);
}

TEST_F(BadRequestsTest, RefusesPortInUse) {
  StartServer();
  const ProcessResult second =
      Serve({"--listen", server().address(), "--data-dir", Path("other").string()});
  EXPECT_NE(second.exit_code, 0);
  ExpectRefusal(second, second.exit_code, {server().address()});
}

TEST_F(BadRequestsTest, RefusesDataFolderInUse) {
  StartServer();
  const ProcessResult second =
      Serve({"--listen", "127.0.0.1:0", "--data-dir", (Path("server") / "data").string()});
  EXPECT_NE(second.exit_code, 0);
  ExpectRefusal(second, second.exit_code, {(Path("server") / "data").string()});
}

TEST_F(BadRequestsTest, RefusesReadOnlyDataFolder) {
  WriteFileAtomic(Path("file"), "in the way");
  // Writing below a regular file fails, even for root.
  for (const std::string& folder : {(Path("file") / "data").string(), std::string("/proc/data")}) {
    const ProcessResult result = Serve({"--listen", "127.0.0.1:0", "--data-dir", folder});
    EXPECT_FALSE(result.timed_out);
    EXPECT_NE(result.exit_code, 0);
    ExpectRefusal(result, result.exit_code, {folder});
  }
}

TEST_F(BadRequestsTest, RefusesPublicAddressWithoutTls) {
  const ProcessResult result =
      Serve({"--listen", "0.0.0.0:0", "--data-dir", Path("data").string()});
  EXPECT_NE(result.exit_code, 0);
  ExpectRefusal(result, result.exit_code, {"0.0.0.0"});
}

TEST_F(BadRequestsTest, RefusesDiskWithoutSpace) {
  // The reserve is larger than any disk.
  StartServer({"--reserve-mib", "1000000000"});
  GrayRoom();
  ExpectRefusal(Colorize({}), 4, {"space"});
}

// A mounted file system, unmounted by the destructor.
class SmallDisk {
 public:
  explicit SmallDisk(const fs::path& folder) : folder_(folder) {
    fs::create_directories(folder);
    mounted_ = ::mount("none", folder.c_str(), "tmpfs", 0, "size=4m") == 0;
  }
  ~SmallDisk() {
    if (mounted_) ::umount2(folder_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  bool mounted() const { return mounted_; }

 private:
  const fs::path folder_;
  bool mounted_ = false;
};

TEST_F(BadRequestsTest, FailsWhenDiskFillsUpDuringJob) {
  const SmallDisk disk(Path("server") / "data");
  if (!disk.mounted()) GTEST_SKIP() << "mounting a small file system is not allowed here";
  StartServer({"--reserve-mib", "2"});
  const fs::path room = GrayRoom();
  ExpectRefusal(
      Colorize({"--key-view", "view001", "--key-color", (room / "truth" / "view001.png").string()}),
      4,
      {"disk"});
  StopServer();
}

TEST_F(BadRequestsTest, RefusesManifestPathsOutsideScene) {
  StartServer();
  for (const char* path : {"../secret.png",
                           "images/../../secret.png",
                           "/etc/passwd",
                           "a//b.png",
                           "./a.png",
                           "",
                           "a\\b.png"}) {
    grpc::ClientContext context;
    v1::CreateSceneRequest request;
    v1::SceneFile* file = request.add_files();
    file->set_path(path);
    file->mutable_digest()->set_sha256(std::string(64, 'a'));
    file->mutable_digest()->set_size_bytes(10);
    v1::Scene scene;
    const grpc::Status status =
        v1::SceneService::NewStub(server().channel())->CreateScene(&context, request, &scene);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << path;
    EXPECT_NE(status.error_message().find("path"), std::string::npos) << status.error_message();
  }
  EXPECT_TRUE(server().IsHealthy());
}

}  // namespace
}  // namespace color3d
