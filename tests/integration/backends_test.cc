// Model servers behind a real server: the examples in C++ and Python, and the adapter to an
// image-edit server. Skips those in Python if its packages are missing.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/color/lab.h"
#include "core/image/codec.h"
#include "tests/integration/service_fixture.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using std::chrono::seconds;
using Lines = std::vector<std::string>;

// A program that writes its address to the file that --port-file names.
class Listener {
 public:
  Listener(const fs::path& folder, const Lines& command)
      : folder_(folder), process_(WithPortFile(folder, command), folder / "logs") {
    const fs::path file = folder / "address";
    WaitUntil([&] { return fs::exists(file) || !process_.IsRunning(); }, seconds(60));
    if (fs::exists(file)) address_ = ReadFile(file);
    while (!address_.empty() && address_.back() == '\n') address_.pop_back();
    EXPECT_NE(address_, "") << command.front() << " did not start: " << process_.Err();
  }
  const std::string& address() const { return address_; }

 private:
  static Lines WithPortFile(const fs::path& folder, const Lines& command) {
    fs::create_directories(folder);
    return command + Lines{"--port-file", (folder / "address").string()};
  }
  const fs::path folder_;
  Process process_;
  std::string address_;
};

std::string PythonScript(const std::string& name) {
  return (fs::path(COLOR3D_BACKENDS) / "python" / name).string();
}

class BackendsTest : public ServiceTest {
 protected:
  void MakeScene();
  // Submits a job, waits for its end and returns it.
  v1::Job Run(const std::string& kind, const json& spec);
  // Colours the key view by the backend and returns the job.
  v1::Job ColorKeyView(const std::string& backend, const std::string& prompt = "", int seed = 1);
  fs::path Download(const v1::Job& job);
  // Mean of a Lab plane of the coloured key view.
  double MeanOf(const v1::Job& job, int plane);
  // Runs generate_augmentations with four outpainted pictures of `backend` and checks them.
  void ExpectPicturesOf(const std::string& backend, const v1::Job& key_color);
  // Returns why the interpreter cannot run the protocol with these modules; empty: it can.
  std::string MissingFor(const std::string& modules);

  std::string scene_;
};

void BackendsTest::MakeScene() {
  WriteProceduralScene(Path("room"), SmallRoom(4, /*gray=*/true));
  const ProcessResult result = Client({"scene", "create", Path("room").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const size_t at = result.out.find("scenes/");
  ASSERT_NE(at, std::string::npos) << result.out;
  scene_ = result.out.substr(at, result.out.find_first_of(" \n\",", at) - at);
}

v1::Job BackendsTest::Run(const std::string& kind, const json& spec) {
  WriteFileAtomic(Path("spec.json"), spec.dump());
  const ProcessResult submitted = Client({"job", "submit", Path("spec.json").string()});
  EXPECT_EQ(submitted.exit_code, 0) << submitted.err;
  Client({"job", "watch", NewestJob(kind).name()});
  return NewestJob(kind);
}

v1::Job BackendsTest::ColorKeyView(const std::string& backend,
                                   const std::string& prompt,
                                   int seed) {
  json source{{"backend", backend}};
  if (!prompt.empty()) source["backendInput"] = {{"prompt", prompt}};
  return Run("colorize_key_view",
             {{"scene", scene_}, {"seed", seed}, {"colorizeKeyView", {{"source", source}}}});
}

fs::path BackendsTest::Download(const v1::Job& job) {
  const fs::path folder = Path("artifacts") / job.name();
  const ProcessResult result = Client({"artifact", "download", job.name(), "-o", folder.string()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return folder;
}

double BackendsTest::MeanOf(const v1::Job& job, int plane) {
  EXPECT_EQ(job.state(), v1::Job::STATE_SUCCEEDED) << job.error().message();
  if (job.state() != v1::Job::STATE_SUCCEEDED) return 0.0;
  const Image lab = LabFromSrgb(ReadImage(Download(job) / "key_view_colored.png"));
  double sum = 0.0;
  for (size_t i = 0; i < lab.PlaneSize(); ++i) sum += lab.Plane(plane)[i];
  return sum / static_cast<double>(lab.PlaneSize());
}

void BackendsTest::ExpectPicturesOf(const std::string& backend, const v1::Job& key_color) {
  ASSERT_EQ(key_color.state(), v1::Job::STATE_SUCCEEDED) << key_color.error().message();
  const v1::Job job = Run(
      "generate_augmentations",
      {{"scene", scene_},
       {"inputs", {key_color.name()}},
       {"generateAugmentations",
        {{"backend", backend}, {"samples", 8}, {"kinds", {"KIND_OUTPAINT"}}, {"maxSidePx", 128}}}});
  ASSERT_EQ(job.state(), v1::Job::STATE_SUCCEEDED) << job.error().message();
  const fs::path folder = Download(job);
  const json samples = json::parse(ReadFile(folder / "augmentations.json")).at("samples");
  ASSERT_EQ(samples.size(), 4u);
  Image before;
  for (const json& sample : samples) {
    EXPECT_EQ(sample.at("source"), "backend " + backend);
    EXPECT_EQ(sample.at("kind"), "outpaint");
    const Image picture =
        ReadImage(folder / "augmentations" / (sample.at("name").get<std::string>() + ".png"));
    EXPECT_FALSE(IsGray(picture));
    EXPECT_NE(picture.data, before.data)
        << "the pictures do not show the key view in different corners";
    before = picture;
  }
}

std::string BackendsTest::MissingFor(const std::string& modules) {
  const ProcessResult result =
      RunProcess({COLOR3D_PYTHON, "-c", "import serving, " + modules}, Path("python"), seconds(60));
  if (result.exit_code == 0) return "";
  const std::string& why = result.err;
  const size_t line = why.find_last_of('\n', why.size() < 2 ? 0 : why.size() - 2);
  return std::string(COLOR3D_PYTHON) +
         " cannot run it: " + why.substr(line == std::string::npos ? 0 : line + 1);
}

TEST_F(BackendsTest, ExampleColorsAndGenerates) {
  const Listener backend(Path("backend"),
                         {(fs::path(COLOR3D_BIN_DIR) / "color3d-example-backend").string(),
                          "--listen",
                          "127.0.0.1:0"});
  StartServer({"--backend", "example=" + backend.address()});
  MakeScene();
  ExpectPicturesOf("example", ColorKeyView("example"));
}

TEST_F(BackendsTest, PythonExampleColorsAndGenerates) {
  ::setenv("PYTHONPATH", PythonScript("").c_str(), 1);
  ::setenv("PYTHONDONTWRITEBYTECODE", "1", 1);
  if (const std::string missing = MissingFor("numpy, PIL"); !missing.empty()) {
    GTEST_SKIP() << missing;
  }
  const Listener backend(Path("backend"),
                         {COLOR3D_PYTHON, PythonScript("backend.py"), "--listen", "127.0.0.1:0"});
  StartServer({"--backend", "mine=" + backend.address()});
  MakeScene();
  const v1::Job sepia = ColorKeyView("mine"), blue = ColorKeyView("mine", "all blue");
  EXPECT_GT(MeanOf(sepia, 2), 3.0);
  EXPECT_LT(MeanOf(blue, 2), -3.0);
  ExpectPicturesOf("mine", sepia);
}

TEST_F(BackendsTest, EditServerAdapterColorsAndGenerates) {
  ::setenv("PYTHONPATH", PythonScript("").c_str(), 1);
  ::setenv("PYTHONDONTWRITEBYTECODE", "1", 1);
  if (const std::string missing = MissingFor("grpc"); !missing.empty()) GTEST_SKIP() << missing;
  auto edit = std::make_unique<Listener>(
      Path("edit"), Lines{COLOR3D_PYTHON, PythonScript("example_edit_server.py"), "--port", "0"});
  const Listener backend(Path("backend"),
                         {COLOR3D_PYTHON,
                          PythonScript("edit_backend.py"),
                          "--listen",
                          "127.0.0.1:0",
                          "--url",
                          edit->address(),
                          "--generate",
                          "outpaint",
                          "--generate-method",
                          "generate_frame",
                          "--license",
                          "mine"});
  StartServer({"--backend", "edit=" + backend.address(), "--retry-backoff-ms", "50"});
  MakeScene();
  // The edit server receives texts and numbers of the job's spec.
  const v1::Job red = ColorKeyView("edit", "red brick"), blue = ColorKeyView("edit", "blue paint");
  EXPECT_GT(MeanOf(red, 1), 3.0);
  EXPECT_LT(MeanOf(blue, 2), -3.0);
  const v1::Job other_seed = ColorKeyView("edit", "red brick", 2);
  EXPECT_FALSE(other_seed.cached());
  EXPECT_GT(MeanOf(other_seed, 1), MeanOf(red, 1));
  EXPECT_EQ(json::parse(ReadFile(Download(red) / "key_color.json")).at("description"),
            "image-edit server (mine)");
  ExpectPicturesOf("edit", red);

  edit.reset();
  const v1::Job failed = ColorKeyView("edit", "green", 3);
  EXPECT_EQ(failed.state(), v1::Job::STATE_FAILED);
  for (const char* words : {"edit server http://127.0.0.1:", "cannot be reached", "start it"}) {
    EXPECT_NE(failed.error().message().find(words), std::string::npos) << failed.error().message();
  }
}

}  // namespace
}  // namespace color3d
