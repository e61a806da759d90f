// All sources of the key view's colour, through a real server and real model servers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "tests/integration/service_fixture.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using std::chrono::seconds;
using Lines = std::vector<std::string>;

// color3d-example-backend on its own port.
class ExampleBackend {
 public:
  ExampleBackend(const fs::path& folder, const std::string& listen, const Lines& flags = {})
      : process_(Arguments(folder, listen) + flags, folder / "logs") {
    const fs::path file = folder / "address";
    WaitUntil([&] { return fs::exists(file) || !process_.IsRunning(); }, seconds(60));
    if (fs::exists(file)) address_ = ReadFile(file);
    while (!address_.empty() && address_.back() == '\n') address_.pop_back();
  }
  const std::string& address() const { return address_; }

 private:
  static Lines Arguments(const fs::path& folder, const std::string& listen) {
    fs::create_directories(folder);
    fs::remove(folder / "address");
    return {(fs::path(COLOR3D_BIN_DIR) / "color3d-example-backend").string(),
            "--listen",
            listen,
            "--port-file",
            (folder / "address").string()};
  }
  Process process_;
  std::string address_;
};

class KeyColorTest : public ServiceTest {
 protected:
  // Colours only the key view: the scene's other stages are tested elsewhere.
  v1::Job ColorKeyView(const std::string& scene, const json& source, int seed = 1);
  std::string CreateScene(const fs::path& folder);
  json Facts(const v1::Job& job);
  Image Colored(const v1::Job& job);

 private:
  fs::path Download(const v1::Job& job);
};

std::string KeyColorSpec(const std::string& scene, const json& source, int seed) {
  return json{{"scene", scene}, {"seed", seed}, {"colorizeKeyView", {{"source", source}}}}.dump();
}

std::string KeyColorTestSceneName(const std::string& out) {
  const size_t at = out.find("scenes/");
  return at == std::string::npos ? "" : out.substr(at, out.find_first_of(" \n\",", at) - at);
}

std::string KeyColorTest::CreateScene(const fs::path& folder) {
  const ProcessResult result = Client({"scene", "create", folder.string()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return KeyColorTestSceneName(result.out);
}

v1::Job KeyColorTest::ColorKeyView(const std::string& scene, const json& source, int seed) {
  WriteFileAtomic(Path("spec.json"), KeyColorSpec(scene, source, seed));
  const ProcessResult submitted = Client({"job", "submit", Path("spec.json").string()});
  EXPECT_EQ(submitted.exit_code, 0) << submitted.err;
  const std::string name = NewestJob("colorize_key_view").name();
  Client({"job", "watch", name});
  return NewestJob("colorize_key_view");
}

fs::path KeyColorTest::Download(const v1::Job& job) {
  const fs::path folder = Path("artifacts") / job.name();
  const ProcessResult result = Client({"artifact", "download", job.name(), "-o", folder.string()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return folder;
}

json KeyColorTest::Facts(const v1::Job& job) {
  return json::parse(ReadFile(Download(job) / "key_color.json"));
}

Image KeyColorTest::Colored(const v1::Job& job) {
  return ReadImage(Download(job) / "key_view_colored.png");
}

TEST_F(KeyColorTest, BackendColorsTheKeyViewAndIsReported) {
  const ExampleBackend backend(Path("backend"), "127.0.0.1:0");
  ASSERT_NE(backend.address(), "");
  StartServer({"--backend", "example=" + backend.address()});
  const ProcessResult info = Client({"server", "info"});
  EXPECT_NE(info.out.find("example at " + backend.address() + ", ready"), std::string::npos)
      << info.out;
  WriteProceduralScene(Path("room"), SmallRoom(4, /*gray=*/true));
  const std::string scene = CreateScene(Path("room"));
  const v1::Job job = ColorKeyView(scene, {{"backend", "example"}});
  ASSERT_EQ(job.state(), v1::Job::STATE_SUCCEEDED) << job.error().message();
  const json facts = Facts(job);
  EXPECT_EQ(facts.at("source"), "backend");
  EXPECT_EQ(facts.at("description"), "color3d-example-backend 1 (Apache-2.0)");
  EXPECT_EQ(facts.at("answer_px"), (json{240, 180}));
  EXPECT_LT(facts.at("mean_luminance_difference").get<double>(), 1.0);
  EXPECT_FALSE(IsGray(Colored(job)));
  EXPECT_TRUE(ColorKeyView(scene, {{"backend", "example"}}).cached());

  const v1::Job asked_too_much =
      ColorKeyView(scene, {{"backend", "example"}, {"backendInput", {{"prompt", "red brick"}}}}, 2);
  EXPECT_EQ(asked_too_much.state(), v1::Job::STATE_FAILED);
  EXPECT_NE(asked_too_much.error().message().find("text_prompt"), std::string::npos)
      << asked_too_much.error().message();
}

TEST_F(KeyColorTest, RetrySucceedsWhenTheBackendIsBack) {
  auto backend = std::make_unique<ExampleBackend>(Path("backend"), "127.0.0.1:0");
  const std::string address = backend->address();
  ASSERT_NE(address, "");
  backend.reset();
  StartServer({"--backend", "example=" + address, "--retry-backoff-ms", "50"});
  WriteProceduralScene(Path("room"), SmallRoom(4, /*gray=*/true));
  const v1::Job failed = ColorKeyView(CreateScene(Path("room")), {{"backend", "example"}});
  EXPECT_EQ(failed.state(), v1::Job::STATE_FAILED);
  for (const char* word : {"example", "cannot be reached", "start it"}) {
    EXPECT_NE(failed.error().message().find(word), std::string::npos) << failed.error().message();
  }
  backend = std::make_unique<ExampleBackend>(Path("backend"), address);
  const ProcessResult retried = Client({"job", "retry", failed.name()});
  EXPECT_EQ(retried.exit_code, 0) << retried.err;
  EXPECT_EQ(Client({"job", "watch", failed.name()}).exit_code, 0);
  EXPECT_EQ(NewestJob("colorize_key_view").state(), v1::Job::STATE_SUCCEEDED);
}

TEST_F(KeyColorTest, RetryColorsOnlyTheKeyViewThatFailed) {
  auto backend = std::make_unique<ExampleBackend>(Path("backend"), "127.0.0.1:0");
  const std::string address = backend->address();
  ASSERT_NE(address, "");
  backend.reset();
  StartServer({"--backend", "example=" + address, "--retry-backoff-ms", "50"});
  WriteProceduralScene(Path("room"), SmallRoom(4, /*gray=*/true));
  const json additional = {{"view", "view003.png"}, {"color", {{"backend", "example"}}}};
  const json options = {{"keyView", "view001.png"},
                        {"keyColor", {{"automatic", true}}},
                        {"carryColor", {{"furtherKeyViews", {additional}}}}};
  WriteFileAtomic(Path("spec.json"),
                  json{{"scene", CreateScene(Path("room"))}, {"colorizeScene", options}}.dump());
  ASSERT_EQ(Client({"job", "submit", Path("spec.json").string()}).exit_code, 0);
  const std::string parent = NewestJob("colorize_scene").name();
  const auto key_view = [&](bool is_additional) {
    for (const v1::Job& job : server().ListJobs()) {
      if (job.kind() == "colorize_key_view" &&
          job.spec().colorize_key_view().view().empty() != is_additional) {
        return job;
      }
    }
    return v1::Job();
  };
  const auto reaches = [&](bool is_additional, v1::Job::State state) {
    return WaitUntil([&] { return key_view(is_additional).state() == state; }, seconds(120));
  };
  ASSERT_TRUE(reaches(true, v1::Job::STATE_FAILED)) << key_view(true).error().message();
  EXPECT_NE(key_view(true).error().message().find("cannot be reached"), std::string::npos);
  ASSERT_TRUE(reaches(false, v1::Job::STATE_SUCCEEDED));
  const int attempts = key_view(false).attempt();
  backend = std::make_unique<ExampleBackend>(Path("backend"), address);
  const ProcessResult retried = Client({"job", "retry", parent});
  ASSERT_EQ(retried.exit_code, 0) << retried.err;
  ASSERT_TRUE(reaches(true, v1::Job::STATE_SUCCEEDED)) << key_view(true).error().message();
  EXPECT_EQ(key_view(false).attempt(), attempts);
  EXPECT_EQ(key_view(false).state(), v1::Job::STATE_SUCCEEDED);
  EXPECT_EQ(Client({"job", "cancel", parent}).exit_code, 0);
}

TEST_F(KeyColorTest, CancellingTheJobStopsTheBackend) {
  const ExampleBackend backend(Path("backend"), "127.0.0.1:0", {"--delay-ms", "5000"});
  StartServer({"--backend", "slow=" + backend.address()});
  WriteProceduralScene(Path("room"), SmallRoom(4, /*gray=*/true));
  WriteFileAtomic(Path("spec.json"),
                  KeyColorSpec(CreateScene(Path("room")), {{"backend", "slow"}}, 1));
  ASSERT_EQ(Client({"job", "submit", Path("spec.json").string()}).exit_code, 0);
  ASSERT_TRUE(
      WaitUntil([&] { return NewestJob("colorize_key_view").state() == v1::Job::STATE_RUNNING; },
                seconds(120)));
  const std::string name = NewestJob("colorize_key_view").name();
  ASSERT_EQ(Client({"job", "cancel", name}).exit_code, 0);
  EXPECT_TRUE(
      WaitUntil([&] { return NewestJob("colorize_key_view").state() == v1::Job::STATE_CANCELLED; },
                seconds(20)));
}

// The whole pipeline, from photos only.
TEST_F(KeyColorTest, AutoNeedsNoInput) {
  StartServer();
  WriteProceduralScene(Path("room"), SmallRoom(6, /*gray=*/true));
  const ProcessResult result =
      Client(Lines{"colorize", Path("room").string(), "-o", Path("out").string(), "--auto"} +
             QuickOptions());
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  const json facts = json::parse(ReadFile(Path("out") / "key_color.json"));
  EXPECT_EQ(facts.at("source"), "automatic");
  EXPECT_NE(facts.at("description"), "");
  EXPECT_FALSE(IsGray(ReadImage(Path("out") / "key_view_colored.png")));
  ASSERT_FALSE(ListFiles(Path("out") / "renders").empty());
  EXPECT_TRUE(fs::is_regular_file(Path("out") / "scene.ply"));
}

// Swaps red and blue, within a mask of the left half.
TEST_F(KeyColorTest, EditChangesColorInsideItsMaskOnly) {
  StartServer();
  WriteProceduralScene(Path("room"), SmallRoom(4));
  const Image photo = ReadImage(Path("room") / "images" / "view002.png");
  Image edited = photo;
  std::swap_ranges(edited.Plane(0), edited.Plane(0) + edited.PlaneSize(), edited.Plane(2));
  Image mask(photo.width, photo.height, 1);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width / 2; ++x) mask.At(0, y, x) = 1.0f;
  }
  WriteFileAtomic(Path("edited.png"), EncodePng8(edited));
  WriteFileAtomic(Path("mask.png"), EncodePng8(mask));
  const ProcessResult result = Client({"key",
                                       "color",
                                       Path("room").string(),
                                       "--view",
                                       "view002",
                                       "--edit",
                                       Path("edited.png").string(),
                                       "--mask",
                                       Path("mask.png").string(),
                                       "-o",
                                       Path("key").string()});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  const Image before = LabFromSrgb(photo);
  const Image after = LabFromSrgb(ReadImage(Path("key") / "key_view_colored.png"));
  double inside = 0.0, outside = 0.0;
  for (int y = 0; y < photo.height; ++y) {
    for (int x = 0; x < photo.width; ++x) {
      const double change = std::hypot(after.At(1, y, x) - before.At(1, y, x),
                                       after.At(2, y, x) - before.At(2, y, x));
      double& worst = x < photo.width / 2 ? inside : outside;
      worst = std::max(worst, change);
    }
  }
  EXPECT_GT(inside, 20.0);
  EXPECT_LT(outside, 2.5) << "more than rounding to 8 bits";
}

TEST_F(KeyColorTest, RefusesUnknownModelNamesAtOnce) {
  StartServer();
  WriteProceduralScene(Path("room"), SmallRoom(4, /*gray=*/true));
  const Lines command{"colorize", Path("room").string(), "-o", Path("out").string()};
  ExpectRefusal(Client(command + Lines{"--auto", "--model", "ddcolor"}),
                2,
                {"'ddcolor'", "it has: none", "--model NAME=FILE"});
  ExpectRefusal(Client(command + Lines{"--backend", "uni"}), 2, {"'uni'", "--backend"});
  ExpectRefusal(Client(command + Lines{"--auto", "--encoder", "large"}), 2, {"'large'"});
  ExpectRefusal(Client(command + Lines{"--auto", "--script", "mine"}), 2, {"one source"});
}

TEST_F(KeyColorTest, ServerRefusesUnusableModels) {
  const auto complaint = [&](const Lines& flags) {
    try {
      StartServer(flags);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_NE(complaint({"--model", "a=" + Path("none").string()}).find("no such file"),
            std::string::npos);
  EXPECT_NE(complaint({"--backend", "a=gpu.example:1"}).find("https://gpu.example:1"),
            std::string::npos);
}

}  // namespace
}  // namespace color3d
