#include "core/metrics/temporal_consistency.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <numeric>

#include "core/base/error.h"
#include "core/color/lab.h"

namespace color3d {
namespace {

constexpr int kWidth = 96, kHeight = 64;

// Texture that moves by `step_px` per frame.
Image Luminance(int frame, double step_px) {
  Image image(kWidth, kHeight, 1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double u = x + step_px * frame;
      double l = 50.0;
      for (int k = 1; k <= 5; ++k) {
        const double a = 2.1 * k;
        l += 7.0 * std::sin(0.13 * k * (u * std::cos(a) + y * std::sin(a)) + 2.7 * a);
      }
      image.At(0, y, x) = static_cast<float>(l);
    }
  }
  return image;
}

// Colours that move by `color_step_px` per frame.
Image Lab(int frame, double step_px, double color_step_px, double flicker) {
  Image ab(kWidth, kHeight, 2);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double u = x + color_step_px * frame;
      ab.At(0, y, x) = static_cast<float>(20.0 * std::sin(0.1 * u) + flicker * (frame % 2));
      ab.At(1, y, x) = static_cast<float>(20.0 * std::cos(0.1 * u));
    }
  }
  return JoinLab(Luminance(frame, step_px), ab);
}

std::vector<TemporalConsistency> Measure(
    std::vector<std::vector<int>> shots,
    double step_px,
    const std::vector<std::function<Image(int frame)>>& colorings) {
  ThreadPool pool(2);
  CancellationToken cancel;
  return MeasureTemporalConsistency(
      {std::move(shots), [&](int frame) { return Luminance(frame, step_px); }, colorings},
      pool,
      cancel);
}

std::vector<int> Frames(int count) {
  std::vector<int> frames(count);
  std::iota(frames.begin(), frames.end(), 0);
  return frames;
}

TEST(TemporalConsistency, DivergenceIsJensenShannon) {
  Image dark(4, 2, 3, 0.0f), half = dark;
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < 4; ++i) half.Plane(c)[i] = 1.0f;
  }
  const ColorHistogram p = HistogramOf(dark), q = HistogramOf(half);
  EXPECT_FLOAT_EQ(q[1][0], 0.5f);
  EXPECT_FLOAT_EQ(q[1][255], 0.5f);
  EXPECT_EQ(Divergence(p, p), 0.0);
  // By hand: M = (3/4, 1/4).
  EXPECT_NEAR(Divergence(p, q),
              0.5 * std::log(1 / 0.75) + 0.5 * (0.5 * std::log(0.5 / 0.75) + 0.5 * std::log(2.0)),
              1e-7);
  EXPECT_DOUBLE_EQ(Divergence(p, q), Divergence(q, p));
  EXPECT_NEAR(Divergence(p, HistogramOf(Image(4, 2, 3, 1.0f))), std::log(2.0), 1e-7);
  EXPECT_THROW(HistogramOf(Image(4, 2, 1)), Error);
}

TEST(TemporalConsistency, ColorsThatFollowMotionAreSteady) {
  const double step = 2.0;
  const auto figures = Measure(
      {Frames(40)},
      step,
      {[&](int frame) { return Lab(frame, step, step, 0.0); },
       [&](int frame) { return Lab(frame, step, 0.0, 0.0); },
       [&](int frame) { return Lab(frame, step, step, 6.0); },
       [&](int frame) { return JoinLab(Luminance(frame, step), Image(kWidth, kHeight, 2)); }});
  const auto &steady = figures[0], &stays = figures[1], &flickers = figures[2], &gray = figures[3];
  EXPECT_EQ(steady.pairs, 39);
  EXPECT_GT(steady.followed, 0.8);
  EXPECT_NEAR(steady.chroma, 20.0, 0.2);
  EXPECT_LT(steady.tc_chroma, 0.3);
  // Colours that lie 2 px apart: 20 times 2 sin(0.1).
  EXPECT_NEAR(stays.tc_chroma, 40.0 * std::sin(0.1), 0.4);
  EXPECT_NEAR(flickers.tc_chroma, 6.0, 0.2);
  EXPECT_EQ(gray.tc_chroma, 0.0);
  EXPECT_EQ(gray.chroma, 0.0);
  // Flickers between adjacent frames, not over two.
  EXPECT_GT(flickers.cdc_at[0], 2.0 * flickers.cdc_at[1]);
  EXPECT_GT(flickers.cdc_at[0], 2.0 * steady.cdc_at[0]);
  EXPECT_NEAR(
      flickers.cdc, (flickers.cdc_at[0] + flickers.cdc_at[1] + flickers.cdc_at[2]) / 3.0, 1e-12);
}

TEST(TemporalConsistency, ComparesNothingAcrossCuts) {
  const auto jumping = [](int frame) {
    return Lab(0, 0.0, 0.0, frame < 3 ? 0.0 : frame < 20 ? 1e-9 : 30.0 * (frame - 19));
  };
  const auto one = Measure({{0, 1, 2}, {21, 21, 21}, {22}}, 0.0, {jumping})[0];
  EXPECT_EQ(one.pairs, 4);
  EXPECT_EQ(one.tc_chroma, 0.0);
  EXPECT_EQ(one.cdc, 0.0);
  EXPECT_EQ(one.cdc_at[2], 0.0);
  const auto none = Measure({{0}, {}}, 0.0, {jumping})[0];
  EXPECT_EQ(none.pairs, 0);
  EXPECT_EQ(none.cdc, 0.0);
}

TEST(TemporalConsistency, ComparesLongFilmsInStretches) {
  std::atomic<int> decoded = 0;
  const auto steady = [&](int) {
    ++decoded;
    return Lab(0, 0.0, 0.0, 0.0);
  };
  EXPECT_EQ(Measure({Frames(1000)}, 0.0, {steady})[0].pairs, 256);
  EXPECT_LE(decoded, 16 * 20);
  CancellationToken cancel;
  cancel.Cancel();
  ThreadPool pool(2);
  EXPECT_THROW(MeasureTemporalConsistency(
                   {{Frames(9)}, [](int) { return Luminance(0, 0.0); }, {steady}}, pool, cancel),
               Error);
}

TEST(TemporalConsistency, DoesNotFollowTinyPictures) {
  const auto small = [](int) { return Image(20, 20, 1, 50.0f); };
  ThreadPool pool(1);
  CancellationToken cancel;
  const auto figures = MeasureTemporalConsistency(
      {{{0, 1}}, small, {[](int) { return Image(20, 20, 3, 40.0f); }}}, pool, cancel);
  EXPECT_EQ(figures[0].followed, 0.0);
  EXPECT_EQ(figures[0].tc_chroma, 0.0);
}

}  // namespace
}  // namespace color3d
