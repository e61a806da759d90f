#include "core/stage/film/film_keys.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "core/base/error.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "tests/support/scenes/noise_place.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

using testing::ElementsAre;

constexpr int kWidth = 176, kHeight = 132;

// A film with shots of these lengths, without pictures.
Scene FilmOf(const std::vector<int>& lengths) {
  Scene scene;
  for (size_t shot = 0; shot < lengths.size(); ++shot) {
    for (int i = 0; i < lengths[shot]; ++i) {
      View view;
      view.name = fmt::format("f{:04}.png", scene.views.size());
      view.image_file = view.name;
      view.camera =
          view.captured_camera = {kWidth, kHeight, 180.0, 180.0, kWidth / 2.0, kHeight / 2.0};
      view.moment = Moment{0.04 * static_cast<double>(scene.views.size()), static_cast<int>(shot)};
      scene.views.push_back(view);
    }
  }
  return scene;
}

TEST(FilmKeysTest, FindsCandidatesInEveryShotWithoutFaults) {
  const Scene scene = FilmOf({200, 1, 3, 90, 2});
  const std::vector<int> candidates = CandidatesOfFilm(scene, "");
  EXPECT_LE(candidates.size(), 64u);
  std::vector<int> of_shot(5, 0);
  for (const int view : candidates) ++of_shot[scene.views[view].moment->shot];
  EXPECT_GT(of_shot[0], 30);
  EXPECT_EQ(of_shot[1], 0);
  EXPECT_GE(of_shot[2], 1);
  EXPECT_GE(of_shot[4], 1);
  EXPECT_THAT(CandidatesOfFilm(scene, "f0200"), testing::Contains(200));
  // Faulty frames only.
  EXPECT_EQ(CandidatesOfFilm(FilmOf({1, 1, 1}), "").size(), 3u);
}

TEST(FilmKeysTest, LongestShotWithoutKeyFrameIsNext) {
  const Scene scene = FilmOf({20, 40, 1, 30});
  std::vector<double> coverage(scene.views.size(), 0.0);
  const auto next = AdviseNextFilmKey(scene, {45}, coverage);
  ASSERT_TRUE(next);
  EXPECT_EQ(scene.views[next->view].moment->shot, 3);
  EXPECT_EQ(next->view, 61 + 15);
  EXPECT_GT(next->error_now, next->error_with);
  EXPECT_EQ(scene.views[AdviseNextFilmKey(scene, {45, 70}, coverage)->view].moment->shot, 0);
  EXPECT_FALSE(AdviseNextFilmKey(scene, {45, 70, 3}, coverage));
  // A shot that returns to a place ranks behind one that shows a new place.
  std::fill(coverage.begin() + 61, coverage.end(), 0.9);
  const auto other = AdviseNextFilmKey(scene, {45}, coverage);
  ASSERT_TRUE(other);
  EXPECT_EQ(scene.views[other->view].moment->shot, 0);
  EXPECT_LT(other->error_now, next->error_now);
}

// A film of shots of these lengths at these places.
class FilmKeysStageTest : public StageTest {
 protected:
  void WriteFilm(const std::vector<int>& lengths, const std::vector<uint64_t>& places) {
    scene_ = FilmOf(lengths);
    for (size_t i = 0; i < scene_.views.size(); ++i) {
      const int shot = scene_.views[i].moment->shot;
      WriteFileAtomic(scratch_.path() / scene_.views[i].image_file,
                      EncodePng8(NoisePlace(places[shot], kWidth, kHeight, static_cast<int>(i))));
    }
    AddInput(artifact::kScene, SceneToJson(scene_));
  }
  // Shots of the key views, in order.
  std::vector<int> Select(int count, const std::string& named = "") {
    SelectKeyViewOptions options;
    options.selection.count = count;
    if (!named.empty()) {
      options.selection.strategy = KeyViewStrategy::kManual;
      options.view = named;
    }
    StageContext context = MakeContext();
    RunSelectKeyView(options, context);
    const auto json = nlohmann::json::parse(ReadFile(scratch_.path() / "out/key_view.json"));
    std::vector<std::string> names = {json.at("view")};
    if (json.contains("key_views")) {
      names.clear();
      for (const auto& key : json.at("key_views")) names.push_back(key.at("view"));
      EXPECT_EQ(names[0], json.at("view"));
    }
    std::vector<int> shots;
    std::set<std::string> different(names.begin(), names.end());
    EXPECT_EQ(different.size(), names.size());
    for (const std::string& name : names) {
      shots.push_back(scene_.views[scene_.FindView(name)].moment->shot);
    }
    return shots;
  }
  Scene scene_;
};

TEST_F(FilmKeysStageTest, LongestShotsGetKeyFramesFirst) {
  WriteFilm({6, 14, 9}, {1, 2, 3});
  EXPECT_THAT(Select(1), ElementsAre(1));
  EXPECT_THAT(Select(2), ElementsAre(1, 2));
  EXPECT_THAT(Select(3), ElementsAre(1, 2, 0));
  EXPECT_THAT(Select(4), ElementsAre(1, 2, 0, 1));
  EXPECT_THAT(Select(3, "f0002"), ElementsAre(0, 1, 2));
}

TEST_F(FilmKeysStageTest, NewPlacesComeBeforeReturningShots) {
  WriteFilm({12, 7, 9}, {1, 2, 1});
  EXPECT_THAT(Select(2), ElementsAre(0, 1));
  EXPECT_THAT(Select(3), ElementsAre(0, 1, 0));
  EXPECT_THAT(Select(4), ElementsAre(0, 1, 0, 2));
}

TEST_F(FilmKeysStageTest, RefusesMoreKeyFramesThanFrames) {
  WriteFilm({2, 2}, {1, 2});
  EXPECT_THROW(Select(5), Error);
}

}  // namespace
}  // namespace color3d
