#include "core/film/film_carry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kWidth = 160, kHeight = 112;

// A texture without repetition, seen from a camera that pans and zooms.
struct Scenery {
  double pan_px = 2.0, zoom = 0.0;
  int seed = 1;

  // Smoothed noise of two sizes.
  float L(double u, double v) const {
    return static_cast<float>(50.0 + 40.0 * Noise(u / 7.0, v / 7.0) +
                              40.0 * Noise(u / 15.0, v / 15.0));
  }
  float A(double u, double v) const {
    return static_cast<float>(30.0 * std::sin(0.04 * u + 0.02 * v));
  }
  float B(double u, double v) const {
    return static_cast<float>(30.0 * std::cos(0.03 * v - 0.02 * u));
  }

  Image Luminance(int frame) const { return Picture(frame, 1); }
  Image Ab(int frame) const { return Picture(frame, 2); }

 private:
  // -0.5 to 0.5 at the points of a lattice, smooth in between.
  double Noise(double u, double v) const {
    const auto at = [&](int64_t x, int64_t y) {
      uint64_t h = static_cast<uint64_t>(x) * 0x9e3779b97f4a7c15u ^
                   static_cast<uint64_t>(y) * 0xc2b2ae3d27d4eb4fu ^
                   static_cast<uint64_t>(seed) * 0x165667b19e3779f9u;
      h = (h ^ (h >> 31)) * 0xbf58476d1ce4e5b9u;
      return static_cast<double>((h ^ (h >> 29)) >> 11) / 9007199254740992.0 - 0.5;
    };
    const auto smooth = [](double t) { return t * t * (3.0 - 2.0 * t); };
    const auto x = static_cast<int64_t>(std::floor(u)), y = static_cast<int64_t>(std::floor(v));
    const double s = smooth(u - static_cast<double>(x)), t = smooth(v - static_cast<double>(y));
    return (1.0 - t) * ((1.0 - s) * at(x, y) + s * at(x + 1, y)) +
           t * ((1.0 - s) * at(x, y + 1) + s * at(x + 1, y + 1));
  }
  Image Picture(int frame, int channels) const {
    Image image(kWidth, kHeight, channels);
    const double scale = std::exp(zoom * frame);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double u = scale * (x - kWidth / 2.0) + pan_px * frame,
                     v = scale * (y - kHeight / 2.0);
        if (channels == 1) {
          image.At(0, y, x) = L(u, v);
        } else {
          image.At(0, y, x) = A(u, v);
          image.At(1, y, x) = B(u, v);
        }
      }
    }
    return image;
  }
};

FilmKey KeyOf(const Scenery& scenery, int frame) {
  return {frame, {scenery.Ab(frame), Image(kWidth, kHeight, 1, 1.0f)}};
}

std::map<int, CarriedColor> Carry(const Scenery& scenery,
                                  std::vector<int> shots,
                                  const std::vector<FilmKey>& keys) {
  ThreadPool pool(2);
  CancellationToken cancel;
  std::map<int, CarriedColor> colors;
  const FilmFrames frames{std::move(shots), [&](int frame) {
                            return std::make_shared<const Image>(scenery.Luminance(frame));
                          }};
  CarryAlongFilm(frames, keys, {}, pool, cancel, {[&](int frame, const CarriedColor& color) {
                   EXPECT_TRUE(colors.emplace(frame, color).second) << frame;
                 }});
  return colors;
}

struct Deviation {
  double weighted = 0.0, coverage = 0.0;
};
Deviation ErrorOf(const CarriedColor& color, const Image& truth) {
  double sum = 0.0, weight = 0.0, covered = 0.0;
  for (size_t i = 0; i < truth.PlaneSize(); ++i) {
    const double w = color.confidence.data[i];
    EXPECT_TRUE(std::isfinite(w) && w >= 0.0 && w <= 1.0);
    sum += w * std::hypot(color.ab.Plane(0)[i] - truth.Plane(0)[i],
                          color.ab.Plane(1)[i] - truth.Plane(1)[i]);
    weight += w;
    covered += w > 0.25 ? 1.0 : 0.0;
  }
  return {weight > 0.0 ? sum / weight : 0.0, covered / static_cast<double>(truth.PlaneSize())};
}

TEST(FilmCarryTest, FollowsCameraWithoutDrift) {
  const Scenery scenery{.pan_px = 1.5, .zoom = 0.004};
  const auto colors = Carry(scenery, std::vector<int>(31, 0), {KeyOf(scenery, 15)});
  ASSERT_EQ(colors.size(), 31u);
  for (const int frame : {0, 5, 14, 15, 16, 24, 30}) {
    const Deviation error = ErrorOf(colors.at(frame), scenery.Ab(frame));
    EXPECT_LT(error.weighted, 1.0) << frame;
    EXPECT_GT(error.coverage, 0.6) << frame;
  }
}

TEST(FilmCarryTest, UsesNearestKeyFrameOfShot) {
  const Scenery scenery{.pan_px = 0.0};
  FilmKey red = KeyOf(scenery, 2), green = KeyOf(scenery, 9);
  red.color.ab = Image(kWidth, kHeight, 2, 40.0f);
  green.color.ab = Image(kWidth, kHeight, 2, -40.0f);
  std::vector<int> shots(14, 0);
  shots[4] = 2;  // torn
  for (int i = 12; i < 14; ++i) shots[i] = 1;
  const auto colors = Carry(scenery, shots, {red, green});
  EXPECT_EQ(colors.size(), 11u);
  EXPECT_FALSE(colors.contains(4));
  EXPECT_FALSE(colors.contains(12));
  const auto color = [&](int frame) { return colors.at(frame).ab.At(0, kHeight / 2, kWidth / 2); };
  for (const int frame : {0, 1, 2, 3, 5}) EXPECT_NEAR(color(frame), 40.0f, 1e-3) << frame;
  for (const int frame : {6, 7, 8, 9, 10, 11}) EXPECT_NEAR(color(frame), -40.0f, 1e-3) << frame;
}

TEST(FilmCarryTest, AdditionalKeyFrameChangesNearerFramesOnly) {
  const Scenery scenery{.pan_px = 1.5};
  FilmKey later = KeyOf(scenery, 16);
  for (float& v : later.color.ab.data) v = -v;
  const std::vector<int> shots(21, 0);
  const auto before = Carry(scenery, shots, {KeyOf(scenery, 4)});
  const auto after = Carry(scenery, shots, {KeyOf(scenery, 4), later});
  for (int i = 0; i < 21; ++i) {
    EXPECT_EQ(before.at(i).ab.data == after.at(i).ab.data, i <= 10)
        << i;  // 10 is at the same distance from both
    EXPECT_EQ(before.at(i).confidence.data == after.at(i).confidence.data, i <= 10) << i;
  }
  // Never a mean of both.
  Image opposite = scenery.Ab(13);
  for (float& v : opposite.data) v = -v;
  EXPECT_LT(ErrorOf(after.at(13), opposite).weighted, 1.5);
}

TEST(FilmCarryTest, MeasuresDistanceInTime) {
  FilmFrames frames{{0, 0, 0, 0, 0, 1, 0}, {}};
  const auto owners = [&] {
    std::vector<int> nearest, second;
    for (const NearKeyFrames& near : NearestKeyFrames(frames, {6, 0, 2})) {
      nearest.push_back(near.nearest);
      second.push_back(near.second);
    }
    return std::pair(nearest, second);
  };
  EXPECT_EQ(owners().first, (std::vector<int>{0, 0, 2, 2, 6, -1, 6}));
  EXPECT_EQ(owners().second, (std::vector<int>{2, 2, 0, 6, 2, -1, 2})) << "6 was given first";
  frames.time_s = {0.0, 0.4, 0.5, 0.6, 0.7, 0.8, 2.4};  // the first frames are close in time
  EXPECT_EQ(owners().first, (std::vector<int>{0, 2, 2, 2, 2, -1, 6}));
  EXPECT_EQ(owners().second, (std::vector<int>{2, 0, 0, 0, 0, -1, 2}));
}

// The left end is seen in the first key frame only, the right end in the last one.
TEST(FilmCarryTest, PassesSecondKeyFrameLast) {
  const Scenery scenery{.pan_px = 5.0};
  const std::vector<FilmKey> keys = {KeyOf(scenery, 2), KeyOf(scenery, 9)};
  const FilmFrames frames{std::vector<int>(12, 0), [&](int frame) {
                            return std::make_shared<const Image>(scenery.Luminance(frame));
                          }};
  ThreadPool pool(2);
  CancellationToken cancel;
  std::map<int, CarriedColor> first, second;
  std::map<std::pair<int, int>, FilmWalk> walks;
  const auto carry = [&](int killed_after) {
    FilmResume resume{{}, [&](const FilmWalk& walk) { walks[{walk.key, walk.direction}] = walk; }};
    for (const auto& [place, walk] : walks) resume.walks.push_back(walk);
    CarryAlongFilm(frames,
                   keys,
                   {},
                   pool,
                   cancel,
                   {[&](int frame, const CarriedColor& color) { first[frame] = color; },
                    [&](int frame, const CarriedColor& color) {
                      EXPECT_EQ(first.size(), 12u);
                      EXPECT_TRUE(second.emplace(frame, color).second) << frame;
                      if (static_cast<int>(second.size()) == killed_after) {
                        throw Error(ErrorCode::kAborted, "killed");
                      }
                    }},
                   resume);
  };
  carry(0);
  ASSERT_EQ(second.size(), 12u);
  const auto at_right_end = [&](const std::map<int, CarriedColor>& colors, int frame) {
    return colors.at(frame).confidence.At(0, kHeight / 2, kWidth - 8);
  };
  EXPECT_LT(at_right_end(first, 5), 0.1f);
  EXPECT_GT(at_right_end(second, 5), 0.5f);
  EXPECT_LT(ErrorOf(second.at(5), scenery.Ab(5)).weighted, 1.5);
  const auto whole = std::exchange(second, {});
  walks.clear();
  EXPECT_THROW(carry(5), Error);
  carry(0);
  ASSERT_EQ(second.size(), 12u);
  for (const auto& [frame, color] : whole) {
    EXPECT_EQ(second.at(frame).ab.data, color.ab.data) << frame;
    EXPECT_EQ(second.at(frame).confidence.data, color.confidence.data) << frame;
  }
}

TEST(FilmCarryTest, GivesLostPixelsNoConfidence) {
  const Scenery fast{.pan_px = 90.0};
  const auto colors = Carry(fast, std::vector<int>(6, 0), {KeyOf(fast, 0)});
  EXPECT_LT(ErrorOf(colors.at(5), fast.Ab(5)).coverage, 0.3);
  Scenery cut{.pan_px = 0.0};
  const auto elsewhere = [&](int frame) {
    cut.seed = frame == 0 ? 1 : 5;
    return std::make_shared<const Image>(cut.Luminance(frame));
  };
  ThreadPool pool(1);
  CancellationToken cancel;
  CarryAlongFilm({{0, 0}, elsewhere},
                 {KeyOf({.pan_px = 0.0}, 0)},
                 {},
                 pool,
                 cancel,
                 {[&](int frame, const CarriedColor& color) {
                   if (frame == 0) return;
                   EXPECT_LT(ErrorOf(color, cut.Ab(1)).coverage, 0.45);
                 }});
}

// A blank frame interrupts the optical flow.
TEST(FilmCarryTest, FindsReappearingRegions) {
  const Scenery scenery{.pan_px = 3.0};
  const FilmFrames frames{std::vector<int>(5, 0), [&](int frame) {
                            Image l = scenery.Luminance(frame);
                            if (frame == 2) std::fill(l.data.begin(), l.data.end(), 20.0f);
                            return std::make_shared<const Image>(std::move(l));
                          }};
  ThreadPool pool(2);
  CancellationToken cancel;
  CarryAlongFilm(
      frames, {KeyOf(scenery, 0)}, {}, pool, cancel, {[&](int frame, const CarriedColor& color) {
        if (frame != 4) return;
        const Deviation error = ErrorOf(color, scenery.Ab(frame));
        EXPECT_GT(error.coverage, 0.7);
        EXPECT_LT(error.weighted, 3.0);
      }});
}

TEST(FilmCarryTest, ResumesWithSameBits) {
  const Scenery scenery{.pan_px = 1.5};
  const std::vector<FilmKey> keys = {KeyOf(scenery, 3), KeyOf(scenery, 9)};
  const std::vector<int> shots(14, 0);
  const auto whole = Carry(scenery, shots, keys);
  CancellationToken cancel;
  ThreadPool pool(1);
  std::map<int, CarriedColor> colors;
  std::map<std::pair<int, int>, FilmWalk> walks;
  std::vector<int> read;
  const FilmFrames frames{shots, [&](int frame) {
                            read.push_back(frame);
                            return std::make_shared<const Image>(scenery.Luminance(frame));
                          }};
  const auto told = [&](const FilmWalk& walk) { walks[{walk.key, walk.direction}] = walk; };
  int steps = 0, runs = 0;
  for (bool done = false; !done; ++runs) {
    ASSERT_LT(runs, 20);
    FilmResume resume{{}, told};
    for (const auto& [place, walk] : walks) resume.walks.push_back(walk);
    try {
      CarryAlongFilm(frames,
                     keys,
                     {},
                     pool,
                     cancel,
                     {[&](int frame, const CarriedColor& color) {
                       const bool is_new = colors.emplace(frame, color).second;
                       EXPECT_TRUE(is_new || frame == 3 || frame == 9) << frame;
                       if (is_new && ++steps % 2 == 0) throw Error(ErrorCode::kAborted, "killed");
                     }},
                     resume);
      done = true;
    } catch (const Error& e) {
      ASSERT_EQ(e.code(), ErrorCode::kAborted);
    }
  }
  EXPECT_GT(runs, 6);
  ASSERT_EQ(colors.size(), whole.size());
  for (const auto& [frame, color] : whole) {
    EXPECT_EQ(colors.at(frame).ab.data, color.ab.data) << frame;
    EXPECT_EQ(colors.at(frame).confidence.data, color.confidence.data) << frame;
  }
  // A finished walk reads no more frames.
  read.clear();
  FilmResume resume{{}, {}};
  for (const auto& [place, walk] : walks) resume.walks.push_back(walk);
  CarryAlongFilm(frames, keys, {}, pool, cancel, {[](int, const CarriedColor&) {}}, resume);
  EXPECT_TRUE(read.empty());
}

TEST(FilmCarryTest, AcceptsShortFilmsAndRefusesBadKeys) {
  const Scenery still{.pan_px = 0.0};
  EXPECT_EQ(Carry(still, {0}, {KeyOf(still, 0)}).size(), 1u);
  EXPECT_THROW(Carry(still, {0, 0}, {KeyOf(still, 2)}), Error);
  EXPECT_THROW(Carry(still, {0, 0}, {KeyOf(still, 1), KeyOf(still, 1)}), Error);
  EXPECT_TRUE(Carry(still, {0, 0}, {}).empty());
  ThreadPool pool(1);
  CancellationToken cancel;
  EXPECT_THROW(
      CarryAlongFilm(
          {}, {}, {.cycle_tolerance_px = 0.0}, pool, cancel, {[](int, const CarriedColor&) {}}),
      Error);
}

}  // namespace
}  // namespace color3d
