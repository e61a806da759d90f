// Selection as run by a job: useless frames are never selected, features are computed once.
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/base/random.h"
#include "core/image/codec.h"
#include "core/image/reduced.h"
#include "core/scene/import/import.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "tests/support/quiet_run.h"
#include "tests/support/scenes/procedural_scene.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr KeyViewStrategy kStrategies[] = {
    KeyViewStrategy::kCoverage, KeyViewStrategy::kEntropy, KeyViewStrategy::kTracks};

Image Gray(const Image& image) {
  Image gray(image.width, image.height, 1);
  std::copy_n(image.Plane(image.channels == 3 ? 1 : 0), gray.data.size(), gray.data.begin());
  return gray;
}

Image WithNoise(Image image, double deviation) {
  Random random(5);
  for (float& v : image.data) v += static_cast<float>(deviation * random.NextNormal());
  return image;
}

// Damaged photographs of a scene. `view` is one of its views, in grey.
Image BadFrame(const std::string& kind, const Image& view) {
  Image frame(view.width, view.height, 1);
  if (kind == "white") return Image(view.width, view.height, 1, 1.0f);
  if (kind == "noise") return WithNoise(Image(view.width, view.height, 1, 0.5f), 0.2);
  if (kind == "blurred") {
    return Resize(Resize(view, view.width / 24, view.height / 24), view.width, view.height);
  }
  if (kind == "lens cap") {  // a glow at one side and the sensor's noise
    for (int y = 0; y < view.height; ++y) {
      for (int x = 0; x < view.width; ++x) frame.At(0, y, x) = 0.06f * x / view.width;
    }
    return WithNoise(frame, 0.01);
  }
  if (kind == "half black") {
    for (int y = 0; y < view.height / 2; ++y) {
      for (int x = 0; x < view.width; ++x) frame.At(0, y, x) = view.At(0, y, x);
    }
  }
  return frame;  // "black"
}
const char* const kBadKinds[] = {"black", "white", "noise", "blurred", "lens cap", "half black"};

class SelectTest : public ::testing::Test {
 protected:
  std::string Select(const Scene& scene, KeyViewStrategy strategy, CancellationToken* cancel = {}) {
    WriteFileAtomic(scratch_.path() / "scene.json", SceneToJson(scene));
    fs::create_directories(scratch_.path() / "out");
    CancellationToken never;
    NullObserver silent;
    NoCheckpoints none;
    StageContext::Setup setup;
    setup.scene_folder = scene_folder_;
    setup.inputs = {{artifact::kScene, scratch_.path() / "scene.json"}};
    setup.output_folder = scratch_.path() / "out";
    setup.threads = 2;
    setup.cache_folder = scratch_.path() / "cache";
    StageContext context(setup, none, silent, cancel != nullptr ? *cancel : never);
    SelectKeyViewOptions options;
    options.selection.strategy = strategy;
    RunSelectKeyView(options, context);
    return ReadFile(scratch_.path() / "out" / artifact::kKeyView);
  }
  std::string Chosen(const Scene& scene, KeyViewStrategy strategy) {
    return json::parse(Select(scene, strategy)).at("view");
  }
  int CachedViews() const {
    return static_cast<int>(ListFiles(scratch_.path() / "cache" / "view_features").size());
  }

  // Adds a bad frame made of the view `original`, with its camera and tracks: the worst case.
  void AddBadFrame(const std::string& kind, int original, Scene* scene) {
    View bad = scene->views[original];
    const Image view = Gray(ReadImageWithin(scene_folder_ / bad.image_file, 640));
    bad.name = "zz " + kind + ".png";
    bad.image_file = bad.name;
    WriteFileAtomic(scene_folder_ / bad.image_file, EncodePng8(BadFrame(kind, view)));
    const int index = static_cast<int>(scene->views.size());
    scene->views.push_back(bad);
    for (SparsePoint& point : scene->points) {
      if (std::find(point.views.begin(), point.views.end(), original) != point.views.end()) {
        point.views.push_back(index);
      }
    }
  }

  // Copies the scene to a folder, so that files can be added.
  Scene Import(const fs::path& folder) {
    QuietRun run;
    Scene scene = ImportScene(folder, scratch_.path(), {}, run.control()).scene;
    scene_folder_ = scratch_.path() / ("of " + folder.filename().string());
    fs::create_directories(scene_folder_);
    fs::create_directory_symlink(folder, scene_folder_ / "photos");
    for (View& view : scene.views) view.image_file = "photos/" + view.image_file;
    return scene;
  }

  // `singly`: one kind of bad frame at a time; else all at once.
  void ExpectNoBadFrameWins(const Scene& scene, bool singly) {
    for (KeyViewStrategy strategy : kStrategies) {
      const int best = scene.FindView(Chosen(scene, strategy));
      Scene extended = scene;
      for (const std::string kind : kBadKinds) {
        if (singly) extended = scene;
        AddBadFrame(kind, best, &extended);
        if (!singly && kind != *std::rbegin(kBadKinds)) continue;
        EXPECT_EQ(Chosen(extended, strategy).find("zz"), std::string::npos)
            << kind << ", strategy " << static_cast<int>(strategy);
      }
    }
  }

  const ScratchFolder scratch_;
  fs::path scene_folder_;
};

TEST_F(SelectTest, NeverSelectsBadFramesOfTheRoom) {
  WriteProceduralScene(scratch_.path() / "room", {.views = 8, .width = 240, .height = 180});
  ExpectNoBadFrameWins(Import(scratch_.path() / "room"), /*singly=*/true);
}

TEST_F(SelectTest, NeverSelectsBadFramesOfRealScenes) {
  const fs::path scenes = fs::path(COLOR3D_SHARED_DATA) / "scenes";
  if (!fs::exists(scenes)) GTEST_SKIP() << "no shared data";
  for (const char* name : {"fern", "banana", "fox", "sceaux"}) {
    SCOPED_TRACE(name);
    ExpectNoBadFrameWins(Import(fs::canonical(scenes / name)), /*singly=*/false);
  }
}

TEST_F(SelectTest, ComputesFeaturesOfNewPhotosOnly) {
  scene_folder_ = scratch_.path() / "room";
  WriteProceduralScene(scene_folder_, {.views = 6, .width = 160, .height = 120});
  QuietRun run;
  Scene scene = ImportScene(scene_folder_, scratch_.path(), {}, run.control()).scene;
  Scene fewer = scene;
  fewer.views.pop_back();
  fewer.points.clear();
  Select(fewer, KeyViewStrategy::kEntropy);
  EXPECT_EQ(CachedViews(), 5);
  const std::string warm = Select(scene, KeyViewStrategy::kCoverage);
  EXPECT_EQ(CachedViews(), 6);
  fs::remove_all(scratch_.path() / "cache");
  EXPECT_EQ(Select(scene, KeyViewStrategy::kCoverage), warm) << "cached features change the answer";
  for (const std::string& entry : ListFiles(scratch_.path() / "cache" / "view_features")) {
    fs::resize_file(scratch_.path() / "cache" / "view_features" / entry, 200);
  }
  EXPECT_EQ(Select(scene, KeyViewStrategy::kCoverage), warm) << "torn entries";
  // Features depend on the pixels of a photo, not on its pose.
  scene.views[0].camera.fx *= 1.1;
  Select(scene, KeyViewStrategy::kCoverage);
  EXPECT_EQ(CachedViews(), 6);
  WriteFileAtomic(scene_folder_ / scene.views[0].image_file, EncodePng8(Image(160, 120, 1, 0.3f)));
  Select(scene, KeyViewStrategy::kCoverage);
  EXPECT_EQ(CachedViews(), 7);
}

TEST_F(SelectTest, TracksFallBackWithAReason) {
  scene_folder_ = scratch_.path() / "room";
  WriteProceduralScene(scene_folder_, {.views = 5, .width = 160, .height = 120});
  QuietRun run;
  Scene scene = ImportScene(scene_folder_, scratch_.path(), {}, run.control()).scene;
  const json tracks = json::parse(Select(scene, KeyViewStrategy::kTracks));
  EXPECT_EQ(tracks.at("strategy"), "tracks");
  EXPECT_FALSE(tracks.contains("fallback"));
  scene.points.clear();
  const json without = json::parse(Select(scene, KeyViewStrategy::kTracks));
  EXPECT_EQ(without.at("strategy"), "coverage");
  EXPECT_NE(without.at("fallback").get<std::string>().find("points"), std::string::npos);
  EXPECT_NE(without.at("description").get<std::string>().find("Best of "), std::string::npos);
  EXPECT_EQ(ReadImage(scratch_.path() / "out" / artifact::kKeyViewRanking).width, 1600);
  CancellationToken cancel;
  cancel.Cancel();
  EXPECT_THROW(Select(scene, KeyViewStrategy::kTracks, &cancel), Error);
}

TEST_F(SelectTest, NamesAnUnreadablePhoto) {
  scene_folder_ = scratch_.path() / "room";
  WriteProceduralScene(scene_folder_, {.views = 3, .width = 160, .height = 120});
  QuietRun run;
  Scene scene = ImportScene(scene_folder_, scratch_.path(), {}, run.control()).scene;
  WriteFileAtomic(scene_folder_ / scene.views[1].image_file, "no image");
  try {
    Select(scene, KeyViewStrategy::kCoverage);
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("view001"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace color3d
