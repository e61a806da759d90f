// Photos that are dropped on the studio while a run goes on, through a real server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "tests/integration/studio_http_fixture.h"

namespace color3d {
namespace {
using nlohmann::json;
using std::chrono::seconds;

class StudioDropTest : public StudioHttpTest {
 protected:
  std::string NewSet(const std::string& name) {
    const std::string made = Call("/api/sets", json({{"name", name}}).dump());
    return json::parse(made).at("id").get<std::string>();
  }
  // Drops photos of the room, from one view to another.
  void Drop(const std::string& set, int begin, int end) {
    for (int i = begin; i < end; ++i) {
      const std::string name = "view00" + std::to_string(i) + ".png";
      Call("/api/sets/" + set + "/files?name=" + name, ReadFile(Path("room") / "images" / name));
    }
  }
  json Get(const std::string& path) {
    const auto answer = http_->Get(path);
    EXPECT_TRUE(answer && answer->status == 200) << path;
    return json::parse(answer ? answer->body : "{}", nullptr, /*allow_exceptions=*/false);
  }
  int PhotosOfNewestRun() {
    v1::GetSceneRequest request;
    request.set_name(NewestJob("colorize_scene").spec().scene());
    grpc::ClientContext context;
    v1::Scene scene;
    const auto stub = v1::SceneService::NewStub(server().channel());
    EXPECT_TRUE(stub->GetScene(&context, request, &scene).ok());
    return scene.photo_count();
  }
  std::string StateOf(const std::string& job) { return Get("/api/jobs/" + job).value("state", ""); }
};

TEST_F(StudioDropTest, PhotosWhileARunGoesOnDisturbNothing) {
  const std::string set = NewSet("first");
  Drop(set, 0, 5);
  const std::string choices = json({{"preset", "fast"}, {"color", "automatic"}}).dump();
  const std::string run =
      json::parse(Call("/api/sets/" + set + "/colorize", choices)).at("id").get<std::string>();
  const auto is_over = [&] {
    const std::string state = StateOf(run);
    return state == "SUCCEEDED" || state == "FAILED" || state == "CANCELLED";
  };
  ASSERT_TRUE(WaitUntil(
      [&] {
        for (const v1::Job& job : server().ListJobs()) {
          if (job.state() == v1::Job::STATE_RUNNING) return true;
        }
        return false;
      },
      seconds(60)));

  // To the same photos, and others.
  Drop(set, 5, 6);
  const std::string other = NewSet("second");
  Drop(other, 1, 5);
  EXPECT_EQ(Get("/api/sets/" + set).at("found").at("photos").size(), 6u);
  EXPECT_EQ(Get("/api/sets/" + other).at("found").at("photos").size(), 4u);
  const json plan = json::parse(Call("/api/sets/" + other + "/plan", choices));
  EXPECT_GT(plan.at("stages").size(), 0u);
  EXPECT_FALSE(is_over()) << "all of this happened during the run";

  ASSERT_TRUE(WaitUntil(is_over, seconds(300)));
  EXPECT_EQ(StateOf(run), "SUCCEEDED");
  // The run has the photos that it began with; another one has all.
  EXPECT_EQ(PhotosOfNewestRun(), 5);
  const std::string again =
      json::parse(Call("/api/sets/" + set + "/colorize", choices)).at("id").get<std::string>();
  EXPECT_EQ(PhotosOfNewestRun(), 6);
  Call("/api/jobs/" + again + "/cancel", "{}");
}

}  // namespace
}  // namespace color3d
