// `color3d job submit --all-in-one`: the personalize jobs of many scenes run together in one
// worker, and survive its death.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "core/base/digest.h"
#include "core/base/files.h"
#include "core/catalogue/artifacts.h"
#include "tests/integration/service_fixture.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using std::chrono::seconds;

// Number of scenes. The long test has COLOR3D_ALL_IN_ONE_SCENES=140.
int SceneCount() {
  const char* text = std::getenv("COLOR3D_ALL_IN_ONE_SCENES");
  return text != nullptr ? std::atoi(text) : 5;
}

// The names, shapes and bytes of the tensors of a safetensors file, without its metadata, which
// has the seconds of the training.
std::string TensorsOf(const fs::path& file) {
  const std::string bytes = ReadFile(file);
  uint64_t size = 0;
  std::memcpy(&size, bytes.data(), sizeof(size));
  json header = json::parse(bytes.substr(sizeof(size), size));
  EXPECT_EQ(header.erase("__metadata__"), 1u);
  return header.dump() + bytes.substr(sizeof(size) + size);
}

class AllInOneTest : public ServiceTest {
 protected:
  // `count` scenes of tiny photos, each with an accepted key view.
  std::vector<std::string> MakeScenes(int count) {
    ProceduralSceneOptions room = SmallRoom(4);
    room.width = 64;
    room.height = 48;
    std::vector<std::string> scenes;
    for (int i = 0; i < count; ++i) {
      room.seed = static_cast<uint64_t>(i) + 1;  // equal photos would give one scene
      const std::string folder = Path("room" + std::to_string(i)).string();
      WriteProceduralScene(folder, room);
      const ProcessResult created = Client({"scene", "create", folder, "--json"});
      EXPECT_EQ(created.exit_code, 0) << created.err;
      scenes.push_back(json::parse(created.out).at("name"));
      const ProcessResult colored =
          Client({"key", "colour", scenes.back(), "--auto", "-o", Path("key").string()});
      EXPECT_EQ(colored.exit_code, 0) << colored.out << colored.err;
      const ProcessResult accepted = Client({"key", "accept", scenes.back()});
      EXPECT_EQ(accepted.exit_code, 0) << accepted.err;
    }
    return scenes;
  }

  std::string Submit(const std::vector<std::string>& scenes, int iterations) {
    const ProcessResult result = Client(
        std::vector<std::string>{"job", "submit", "--all-in-one"} + scenes +
        std::vector<std::string>{"--iterations", std::to_string(iterations), "--again", "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    return json::parse(result.out).at("name");
  }

  std::vector<v1::Job> Children(const std::string& parent) {
    std::vector<v1::Job> children;
    for (const v1::Job& job : server().ListJobs()) {
      if (job.parent() == parent) children.push_back(job);
    }
    return children;
  }

  int CountIn(const std::string& parent, v1::Job::State state) {
    const auto children = Children(parent);
    return static_cast<int>(std::count_if(
        children.begin(), children.end(), [&](const v1::Job& j) { return j.state() == state; }));
  }
};

TEST_F(AllInOneTest, BatchSurvivesItsWorker) {
  StartServer(QuickRecovery());
  const std::vector<std::string> scenes = MakeScenes(3);
  const std::string parent = Submit(scenes, 400);
  ASSERT_TRUE(WaitUntil([&] { return CountIn(parent, v1::Job::STATE_RUNNING) == 3; }, seconds(60)))
      << "they do not run together";
  std::string worker;
  ASSERT_TRUE(WaitUntil(
      [&] {
        const auto children = Children(parent);
        worker = children[0].worker();
        return std::all_of(children.begin(), children.end(), [&](const v1::Job& job) {
          return job.progress().step() > 60 && job.worker() == worker;
        });
      },
      seconds(120)));
  ::kill(std::atoi(worker.substr(worker.rfind('-') + 1).c_str()), SIGKILL);
  ASSERT_TRUE(
      WaitUntil([&] { return CountIn(parent, v1::Job::STATE_SUCCEEDED) == 3; }, seconds(300)));
  for (const v1::Job& job : Children(parent)) {
    EXPECT_EQ(job.attempt(), 2) << job.name();
    EXPECT_GT(job.peak_memory_bytes(), 0);
  }
}

TEST_F(AllInOneTest, ManySmallScenesFinishUnattended) {
  StartServer();
  const int count = SceneCount();
  const std::vector<std::string> scenes = MakeScenes(count);
  const std::string parent = Submit(scenes, 6);
  const ProcessResult watched = Client({"job", "watch", parent}, seconds(1200));
  EXPECT_EQ(watched.exit_code, 0) << watched.out << watched.err;
  int64_t peak = 0;
  std::set<std::string> of_scenes;
  for (const v1::Job& job : Children(parent)) {
    EXPECT_EQ(job.state(), v1::Job::STATE_SUCCEEDED);
    EXPECT_FALSE(job.cached());
    peak = std::max(peak, job.peak_memory_bytes());
    of_scenes.insert(job.spec().scene());
  }
  EXPECT_EQ(of_scenes.size(), scenes.size());
  EXPECT_LT(peak, int64_t{1500} << 20);
}

// Which worker trains a scene, and beside which others, does not change its colorizer.
TEST_F(AllInOneTest, TwoWorkersGiveTheResultsOfSoloRuns) {
  StartServer({"--workers", "2", "--threads", "1"});
  const std::vector<std::string> scenes = MakeScenes(SceneCount());
  const auto colorizers = [&](const std::string& parent) {
    std::map<std::string, std::string> tensors;
    for (const v1::Job& job : Children(parent)) {
      EXPECT_EQ(job.state(), v1::Job::STATE_SUCCEEDED) << job.name();
      if (!job.spec().has_personalize()) continue;
      const fs::path folder = Path(job.name());  // jobs/ID
      const ProcessResult fetched =
          Client({"artifact", "download", job.name(), "-o", folder.string()});
      EXPECT_EQ(fetched.exit_code, 0) << fetched.err;
      tensors[job.spec().scene()] = Sha256Hex(TensorsOf(folder / artifact::kColorizer));
    }
    return tensors;
  };
  const std::string together = Submit(scenes, 40);
  EXPECT_EQ(Client({"job", "watch", together}, seconds(1200)).exit_code, 0);
  std::set<std::string> workers;
  for (const v1::Job& job : Children(together)) workers.insert(job.worker());
  EXPECT_EQ(workers.size(), 2u) << "one worker took all";
  std::map<std::string, std::string> solo;
  for (const std::string& scene : scenes) {
    const std::string alone = Submit({scene}, 40);
    EXPECT_EQ(Client({"job", "watch", alone}, seconds(300)).exit_code, 0);
    solo.merge(colorizers(alone));
  }
  EXPECT_EQ(solo.size(), scenes.size());
  EXPECT_EQ(colorizers(together), solo);
}

TEST_F(AllInOneTest, NamesASceneWithoutAKeyView) {
  StartServer();
  ProceduralSceneOptions room = SmallRoom(4);
  WriteProceduralScene(Path("room"), room);
  const ProcessResult created = Client({"scene", "create", Path("room").string(), "--json"});
  const std::string scene = json::parse(created.out).at("name");
  ExpectRefusal(
      Client({"job", "submit", "--all-in-one", scene}), 2, {scene, "no accepted key view"});
  ExpectRefusal(Client({"job", "submit"}), 2, {"--all-in-one"});
}

}  // namespace
}  // namespace color3d
