#include "client/studio/share/side_by_side.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/files.h"
#include "core/base/parallel.h"
#include "core/video/film_reader.h"
#include "core/video/mp4_writer.h"

namespace color3d::client {
namespace {

constexpr int kMovieWidth = 96, kMovieHeight = 64, kMovieFrames = 6;

// Red on the left, blue on the right, brighter from frame to frame.
Image Frame(int i) {
  Image frame(kMovieWidth, kMovieHeight, 3);
  for (int y = 0; y < kMovieHeight; ++y) {
    for (int x = 0; x < kMovieWidth; ++x) {
      frame.At(0, y, x) = x < kMovieWidth / 2 ? 0.6f + 0.05f * static_cast<float>(i) : 0.1f;
      frame.At(1, y, x) = 0.15f;
      frame.At(2, y, x) = x < kMovieWidth / 2 ? 0.1f : 0.7f;
    }
  }
  return frame;
}

TEST(SideBySideTest, GrayIsLeftAndColorRight) {
  const ScratchFolder scratch;
  const auto movie = scratch.path() / "a.mp4", both = scratch.path() / "both.mp4";
  ThreadPool pool(1);
  Mp4Writer writer(movie,
                   {.width = kMovieWidth, .height = kMovieHeight, .frames_per_second = 10.0});
  for (int i = 0; i < kMovieFrames; ++i) writer.Add(Frame(i), pool);
  writer.Finish();
  const CancellationToken cancel;
  WriteSideBySide(movie, both, cancel);
  FilmReader reader(both);
  ASSERT_EQ(reader.facts().width, 2 * kMovieWidth);
  ASSERT_EQ(reader.facts().height, kMovieHeight);
  ASSERT_EQ(reader.times().size(), size_t{kMovieFrames});
  EXPECT_NEAR(reader.times()[3], 0.3, 1e-3);
  const Image picture = reader.Read(kMovieFrames - 1);
  const int y = kMovieHeight / 2;
  for (const int x : {kMovieWidth / 4, 3 * kMovieWidth / 4}) {
    EXPECT_NEAR(picture.At(0, y, x), picture.At(2, y, x), 0.03f) << "grey";
    EXPECT_GT(std::abs(picture.At(0, y, kMovieWidth + x) - picture.At(2, y, kMovieWidth + x)), 0.4f)
        << "colour";
  }
}

}  // namespace
}  // namespace color3d::client
