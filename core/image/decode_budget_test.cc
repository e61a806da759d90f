#include "core/image/decode_budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <barrier>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <thread>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/memory.h"
#include "core/base/parallel.h"
#include "core/base/process/process_limits.h"
#include "core/base/random.h"
#include "core/image/area_reducer.h"
#include "core/image/codec.h"
#include "core/image/reduced.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

constexpr int64_t kMiB = int64_t{1} << 20;

TEST(DecodeBudget, NamesSizesIfOnePictureDoesNotFit) {
  DecodeBudget budget([] { return 1000 * kMiB; });
  try {
    const PictureTurn turn({"wall.png", 14'000, 14'000, 2352 * kMiB}, budget);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kResourceExhausted);
    EXPECT_THAT(e.what(), HasSubstr("wall.png has 14000 x 14000 px"));
    EXPECT_THAT(e.what(), HasSubstr("takes 2352 MiB"));
    EXPECT_THAT(e.what(), HasSubstr("900 MiB are granted"));
    EXPECT_THAT(e.what(), HasSubstr("reduce it to 8660 x 8660 px"));
  }
  const PictureTurn fits({"wall.png", 8660, 8660, 899 * kMiB}, budget);
}

TEST(DecodeBudget, LimitsConcurrentDecodes) {
  DecodeBudget budget([] { return 1000 * kMiB; });
  std::atomic<int> running{0}, most{0};
  ThreadPool pool(8);
  std::barrier<> start(8);
  pool.ForEach(64, [&](int64_t i, int) {
    if (i < 8) start.arrive_and_wait();
    const PictureTurn turn({"a.png", 10'000, 2'600, 300 * kMiB}, budget);
    const int now = ++running;
    for (int seen = most; seen < now && !most.compare_exchange_weak(seen, now);) {
    }
    std::this_thread::yield();
    --running;
  });
  EXPECT_GE(most, 1);
  EXPECT_LE(most, 3);
}

TEST(DecodeBudget, NestedTurnsOfOneThreadDoNotWait) {
  DecodeBudget budget([] { return 1000 * kMiB; });
  const PictureTurn whole({"a.png", 10'000, 7'000, 800 * kMiB}, budget);
  const PictureTurn part({"a.png", 10'000, 7'000, 700 * kMiB}, budget);  // must not deadlock
}

TEST(DecodingBytes, CountsCodecMemory) {
  ImageInfo info;
  info.format = ImageFormat::kPng;
  info.width = info.height = 1000;
  info.channels = 3;
  EXPECT_EQ(DecodingBytes(info, false), 15'000'000);
  EXPECT_EQ(DecodingBytes(info, true), 24'000'000);
  info.bits_per_channel = 16;
  EXPECT_EQ(DecodingBytes(info, false), 18'000'000);
  info.channels = 2;  // four in the codec
  EXPECT_EQ(DecodingBytes(info, false), 24'000'000);
}

TEST(AreaReducer, AveragesLikeResize) {
  Random random(3);
  for (const auto& [width, height] : {std::pair{31, 17}, {20, 40}, {64, 64}, {65, 3}}) {
    std::vector<uint8_t> samples(static_cast<size_t>(width) * height * 3);
    for (uint8_t& v : samples) v = static_cast<uint8_t>(256 * random.NextUniform());
    Image whole(width, height, 3);
    for (size_t i = 0; i < samples.size(); ++i) whole.Plane(i % 3)[i / 3] = samples[i];
    for (const auto& [to_width, to_height] : {std::pair{7, 3}, {10, 2}, {1, 1}, {20, 3}}) {
      AreaReducer reducer(width, height, 3, to_width, to_height);
      for (int y = 0; y < height; ++y) reducer.AddRow(&samples[size_t{3} * y * width]);
      const Image reduced = reducer.Take();
      const Image expected = Resize(whole, to_width, to_height);
      for (size_t i = 0; i < expected.data.size(); ++i) {
        ASSERT_NEAR(reduced.data[i], expected.data[i], 1e-3) << i << " of " << to_width;
      }
    }
  }
}

// 5000 x 5000 px of RGB with an orientation: 300 MiB of floats, which are never held.
TEST(ReadImageResized, ReducesLargePictureBeforeFloats) {
  const ScratchFolder scratch;
  cv::Mat mat(5000, 5000, CV_8UC3, cv::Scalar(10, 20, 30));
  mat(cv::Rect(0, 0, 2500, 5000)).setTo(cv::Scalar(50, 60, 70));
  mat(cv::Rect(0, 0, 2500, 1000)).setTo(cv::Scalar(90, 80, 200));
  const std::string file = (scratch.path() / "a.png").string();
  cv::imwrite(file, mat);
  const auto half = [](const PictureSize& own) {
    EXPECT_EQ(own.width, 5000);
    return PictureSize{50, 25};
  };
  const Image reduced = ReadImageResized(file, half);
  const Image expected = Resize(ReadImage(file), 50, 25);
  ASSERT_EQ(reduced.width, 50);
  ASSERT_EQ(reduced.height, 25);
  ASSERT_EQ(reduced.channels, 3);
  for (size_t i = 0; i < expected.data.size(); ++i) {
    ASSERT_NEAR(reduced.data[i], expected.data[i], 1e-4) << i;
  }
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// 9000 x 9000 px of RGB: 243 MB as stored, 972 MB as floats. Four threads at once would take four
// times as much; 512 MiB are enough for one after the other.
TEST(ReadImageResized, ConcurrentReadsStayWithinMemoryLimit) {
  const ScratchFolder scratch;
  const std::string file = (scratch.path() / "flat.png").string();
  cv::imwrite(
      file, cv::Mat(9000, 9000, CV_8UC3, cv::Scalar(10, 20, 30)), {cv::IMWRITE_PNG_COMPRESSION, 1});
  const pid_t child = ::fork();
  if (child == 0) {
    ProcessLimits limits;
    limits.memory_bytes = OwnMemoryBytes() + 512 * kMiB;
    if (!LimitProcess(limits)) ::_exit(2);
    try {
      std::atomic<int> good{0};
      ThreadPool pool(4);
      pool.ForEach(4, [&](int64_t, int) {
        const Image small = ReadImageFitted(file, 64);
        if (small.width == 64 && std::abs(small.At(0, 9, 9) - 30.0f / 255.0f) < 1e-3f) ++good;
      });
      ::_exit(good == 4 ? 0 : 3);
    } catch (...) {
      ::_exit(4);
    }
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}
#endif

TEST(ReadImageResized, SizeCheckThrowsBeforeDecoding) {
  const ScratchFolder scratch;
  Image image(8, 6, 1, 0.5f);
  WriteFileAtomic(scratch.path() / "a.png", EncodePng8(image));
  EXPECT_THROW(
      ReadImageResized(scratch.path() / "a.png",
                       [](const PictureSize&) -> PictureSize { throw InvalidArgument("no"); }),
      Error);
  EXPECT_EQ(ReadImageFitted(scratch.path() / "a.png", 4).width, 4);
  EXPECT_EQ(ReadImageFitted(scratch.path() / "a.png", 100).width, 8);
}

}  // namespace
}  // namespace color3d
