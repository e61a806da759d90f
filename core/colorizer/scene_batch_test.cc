// Training of many scenes in one batch: fair turns, and results that do not depend on other scenes.
#include "core/colorizer/scene_batch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <thread>
#include <vector>

#include "core/colorizer/colorizer.h"
#include "core/colorizer/personal/scene_colorizers.h"
#include "core/colorizer/personal/train_colorizer.h"

namespace color3d {
namespace {

constexpr int kScenes = 3;

const std::shared_ptr<const Encoder>& TheEncoder() {
  static const std::shared_ptr<const Encoder> encoder = Encoder::Embedded();
  return encoder;
}

// The same picture in every scene, with permuted colours, to detect wrong routes.
TrainingPicture KeyOf(int scene) {
  constexpr float kColors[kScenes][2] = {{40.0f, 30.0f}, {-40.0f, -10.0f}, {0.0f, 60.0f}};
  TrainingPicture key{"key", Image(96, 64, 1), Image(96, 64, 2)};
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 96; ++x) {
      const bool left = x < 48;
      key.luminance.At(0, y, x) = 50.0f + 20.0f * std::sin(left ? 0.9f * x : 0.9f * y);
      for (int c = 0; c < 2; ++c) {
        key.ab.At(c, y, x) = kColors[(scene + (left ? 0 : 1)) % kScenes][c];
      }
    }
  }
  return key;
}

ColorizerOptions Quick() {
  ColorizerOptions options;
  options.iterations = 12;
  options.crop_px = 64;
  return options;
}

std::shared_ptr<const Colorizer> TrainAlone(int scene) {
  ThreadPool pool(2);
  NoCheckpoints none;
  NullObserver silent;
  return TrainColorizer(TheEncoder(), {KeyOf(scene)}, Quick(), {pool, none, silent, {}});
}

float LargestDifference(const Image& x, const Image& y) {
  float largest = x.data.size() == y.data.size() ? 0.0f : 1e9f;
  for (size_t i = 0; i < std::min(x.data.size(), y.data.size()); ++i) {
    largest = std::max(largest, std::abs(x.data[i] - y.data[i]));
  }
  return largest;
}

struct FailingStore : NoCheckpoints {
  bool WantsSave() override { return true; }
  void Save(const std::string&) override { throw Error(ErrorCode::kAborted, "the disk is gone"); }
};

struct CancelAfter : NullObserver {
  explicit CancelAfter(CancellationToken* cancel) : token(cancel) {}
  void OnProgress(int64_t step, int64_t, const std::string&) override {
    if (step >= 3) token->Cancel();
  }
  CancellationToken* token;
};

// In one batch: the scenes, a scene with a NaN, one that is cancelled and one whose checkpoint
// store throws.
TEST(SceneBatchTest, ResultsDoNotDependOnOtherScenes) {
  SceneBatch batch(2);
  std::vector<std::shared_ptr<const Colorizer>> together(kScenes);
  std::atomic<int> failures{0};
  std::vector<std::thread> threads;
  for (int scene = 0; scene < kScenes; ++scene) {
    threads.emplace_back([&, scene] {
      ThreadPool pool(2);
      NoCheckpoints none;
      NullObserver silent;
      together[scene] = TrainColorizer(
          TheEncoder(), {KeyOf(scene)}, Quick(), {pool, none, silent, {}}, BatchPlace{batch, "a"});
    });
  }
  for (int poison = 0; poison < 3; ++poison) {
    threads.emplace_back([&, poison] {
      TrainingPicture key = KeyOf(0);
      if (poison == 0) key.ab.data[7] = std::numeric_limits<float>::quiet_NaN();
      CancellationToken cancel;
      CancelAfter cancelling(&cancel);
      NullObserver silent;
      NoCheckpoints none;
      FailingStore failing;
      ColorizerOptions options = Quick();
      options.iterations = 60;
      try {
        ThreadPool pool(2);
        const RunControl control{pool,
                                 poison == 2 ? static_cast<CheckpointStore&>(failing) : none,
                                 poison == 1 ? static_cast<ProgressObserver&>(cancelling) : silent,
                                 cancel};
        TrainColorizer(TheEncoder(), {key}, options, control, BatchPlace{batch, "b"});
      } catch (const Error&) {
        ++failures;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(failures, 3);
  EXPECT_EQ(batch.size(), 0);

  std::vector<RoutedPicture> pictures;
  const TrainingPicture key = KeyOf(0);
  TrainingPicture wide = KeyOf(0);
  wide.luminance = Image(150, 40, 1, 50.0f);
  for (int scene : {2, 0, 1, 0}) {
    pictures.push_back({std::to_string(scene), &key.luminance});
  }
  pictures.push_back({"1", &wide.luminance});
  const auto routed = ColorizeRouted(
      pictures, [&](const std::string& scene) { return together[std::stoi(scene)]; });
  std::vector<std::shared_ptr<const Colorizer>> alone;
  for (int scene = 0; scene < kScenes; ++scene) {
    alone.push_back(TrainAlone(scene));
    const Image expected = alone[scene]->Colorize(key.luminance);
    ASSERT_NE(together[scene], nullptr);
    EXPECT_EQ(LargestDifference(together[scene]->Colorize(key.luminance), expected), 0.0f);
  }
  for (size_t i = 0; i < pictures.size(); ++i) {
    const Image expected = alone[std::stoi(pictures[i].scene)]->Colorize(*pictures[i].luminance);
    EXPECT_LT(LargestDifference(routed[i], expected), 1e-4f) << i;
  }
  EXPECT_GT(LargestDifference(routed[0], routed[1]), 5.0f);
}

// Project "a" has five scenes, "b" has one, which gets about half of the time.
TEST(SceneBatchTest, SharesTurnsFairlyBetweenProjects) {
  SceneBatch batch(1);
  std::atomic<bool> stop{false};
  std::vector<std::atomic<int>> turns(6);
  std::vector<std::thread> threads;
  for (int i = 0; i < 6; ++i) {
    threads.emplace_back([&, i] {
      SceneBatch::Membership membership(batch, i < 5 ? "a" : "b");
      while (!stop) {
        SceneBatch::Turn turn(membership, {});
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        ++turns[i];
      }
    });
  }
  while (turns[5] < 100) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  stop = true;
  for (std::thread& thread : threads) thread.join();
  int of_a = 0;
  for (int i = 0; i < 5; ++i) {
    of_a += turns[i];
    EXPECT_GT(turns[i], 8) << i;
  }
  EXPECT_GT(of_a, 60);
  EXPECT_LT(of_a, 160);
}

TEST(SceneBatchTest, CancelsWaitingScene) {
  SceneBatch batch(1);
  SceneBatch::Membership first(batch, "a"), second(batch, "a");
  const SceneBatch::Turn turn(first, {});
  CancellationToken cancel;
  std::thread canceller([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    cancel.Cancel();
  });
  EXPECT_THROW(SceneBatch::Turn(second, cancel), Error);
  canceller.join();
}

TEST(SceneBatchTest, LoadsSharedEncoderOnce) {
  SceneBatch batch(1);
  int loads = 0;
  const auto load = [&] {
    ++loads;
    return Encoder::Embedded();
  };
  auto first = batch.SharedEncoder("e", load);
  const auto second = batch.SharedEncoder("e", load);
  EXPECT_EQ(first, second);
  EXPECT_EQ(loads, 1);
}

}  // namespace
}  // namespace color3d
