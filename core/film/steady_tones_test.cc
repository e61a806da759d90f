#include "core/film/steady_tones.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/film/shots.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

constexpr int kWidth = 112, kHeight = 84;

// A pan along a wall with a dark moving object before it, in fixed grain.
Image Scenery(int frame, double pan_px) {
  Image image(kWidth, kHeight, 1);
  std::mt19937 grain(static_cast<unsigned>(frame));
  std::normal_distribution<double> noise(0.0, 0.6);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double u = x + pan_px * frame;
      double l = 48.0 + 8.0 * std::sin(0.021 * u);
      for (int k = 1; k <= 6; ++k) {
        const double a = 2.1 * k + 1.3;
        l += 4.5 * std::sin(0.11 * k * (u * std::cos(a) + y * std::sin(a)) + 2.7 * a);
      }
      if (std::hypot(x - 10.0 - 2.5 * frame, y - 45.0) < 14.0) l = 18.0 + 0.3 * l;
      image.At(0, y, x) = static_cast<float>(std::clamp(l + noise(grain), 0.0, 100.0));
    }
  }
  return image;
}

struct Exposure {
  double gain = 1.0, offset = 0.0;
  float Of(float l) const { return static_cast<float>(std::clamp(gain * l + offset, 0.0, 100.0)); }
};

std::vector<Exposure> Flicker(int frames) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> gain(0.85, 1.15), offset(-4.0, 4.0);
  std::vector<Exposure> exposures;
  for (int i = 0; i < frames; ++i) exposures.push_back({gain(random), offset(random)});
  return exposures;
}

Image Exposed(Image image, const Exposure& exposure) {
  for (float& v : image.data) v = exposure.Of(v);
  return image;
}

SteadyTones Find(const std::vector<Image>& pictures, std::vector<int> shots = {}) {
  ThreadPool pool(2);
  CancellationToken cancel;
  if (shots.empty()) shots.assign(pictures.size(), 0);
  return FindSteadyTones(pictures, shots, pool, cancel);
}

// Change of tones by exposure from a frame to the next, mean over tones of 25..75.
double FlickerOf(const std::vector<Exposure>& exposures, const std::vector<ToneCurve>& curves) {
  const auto seen = [&](size_t frame, float tone) {
    Image pixel(1, 1, 1, exposures[frame].Of(tone));
    return static_cast<double>(ApplyToneCurve(pixel, curves[frame]).data[0]);
  };
  double sum = 0.0;
  int count = 0;
  for (size_t i = 0; i + 1 < exposures.size(); ++i) {
    for (float tone = 25.0f; tone <= 75.0f; tone += 10.0f, ++count) {
      sum += std::abs(seen(i + 1, tone) - seen(i, tone));
    }
  }
  return sum / count;
}

TEST(SteadyTonesTest, ReducesFlickerToAFifth) {
  constexpr int kFrames = 40;
  for (const double pan_px : {0.0, 1.5}) {
    const std::vector<Exposure> exposures = Flicker(kFrames);
    std::vector<Image> pictures;
    for (int i = 0; i < kFrames; ++i) {
      pictures.push_back(Exposed(Scenery(i, pan_px), exposures[i]));
    }
    const SteadyTones tones = Find(pictures);
    const double before = FlickerOf(exposures, std::vector<ToneCurve>(kFrames));
    const double after = FlickerOf(exposures, tones.curves);
    std::printf("pan %.1f px: flicker %.2f L before, %.2f after; told %.2f, %.2f\n",
                pan_px,
                before,
                after,
                tones.flicker_before,
                tones.flicker_after);
    EXPECT_LT(after, before / 5.0) << pan_px;
    EXPECT_NEAR(tones.flicker_before, before, 0.35 * before);
    EXPECT_LT(tones.flicker_after, tones.flicker_before / 4.0);
  }
}

TEST(SteadyTonesTest, KeepsSteadyFilms) {
  for (const double pan_px : {0.0, 1.5, 4.0}) {
    std::vector<Image> pictures;
    for (int i = 0; i < 30; ++i) pictures.push_back(Scenery(i, pan_px));
    const SteadyTones tones = Find(pictures);
    double worst = 0.0;
    for (int i = 0; i < 30; ++i) {
      const Image steady = ApplyToneCurve(pictures[i], tones.curves[i]);
      for (size_t p = 0; p < steady.data.size(); ++p) {
        worst = std::max<double>(worst, std::abs(steady.data[p] - pictures[i].data[p]));
      }
    }
    std::printf("pan %.1f px: at most %.3f L changed\n", pan_px, worst);
    EXPECT_LT(worst, 0.5) << pan_px;
  }
}

TEST(SteadyTonesTest, KeepsSlowFades) {
  std::vector<Image> pictures;
  for (int i = 0; i < 30; ++i) {
    pictures.push_back(Exposed(Scenery(i, 0.5), {0.6 + 0.4 * i / 29.0, 0.0}));
  }
  const SteadyTones tones = Find(pictures);
  for (const int i : {0, 1, 10, 15, 28, 29}) {
    EXPECT_NEAR(ApplyToneCurve(Image(1, 1, 1, 50.0f), tones.curves[i]).data[0], 50.0, 1.0) << i;
  }
}

TEST(SteadyTonesTest, TreatsShotsSeparately) {
  std::vector<Image> pictures;
  std::vector<int> shots;
  for (int i = 0; i < 20; ++i) {
    pictures.push_back(Exposed(Scenery(i % 10, 0.0), {i < 10 ? 1.0 : 0.5, 0.0}));
    shots.push_back(i < 10 ? 0 : 1);
  }
  pictures.push_back(Image(kWidth, kHeight, 1, 2.0f));  // blank
  shots.push_back(2);
  const SteadyTones tones = Find(pictures, shots);
  for (const int i : {8, 9, 10, 11}) {
    EXPECT_NEAR(ApplyToneCurve(Image(1, 1, 1, 30.0f), tones.curves[i]).data[0], 30.0, 0.5) << i;
  }
  EXPECT_TRUE(tones.curves[20].empty());
  EXPECT_TRUE(Find({Scenery(0, 0.0), Scenery(1, 0.0)}).curves[0].empty());
  EXPECT_TRUE(Find({}).curves.empty());
  EXPECT_THROW(Find(pictures, {0, 0}), Error);
  EXPECT_THROW(Find({Image(8, 8, 1), Image(8, 9, 1)}), Error);
}

TEST(SteadyTonesTest, HalvesFlickerOfRealFilms) {
  const std::filesystem::path historic = std::filesystem::path(COLOR3D_SHARED_DATA) / "historic";
  if (!std::filesystem::exists(historic)) GTEST_SKIP() << "no films";
  for (const char* film : {"film_001", "film_002", "film_003"}) {
    std::vector<Image> pictures, thumbnails;
    for (const std::string& file : ListFiles(historic / film)) {
      if (!HasImageExtension(file)) continue;
      const Image luminance = LuminanceFromSrgb(ReadImage(historic / film / file));
      pictures.push_back(FitWithin(luminance, kTonePicturePx));
      thumbnails.push_back(FitWithin(luminance, kShotThumbnailPx));
    }
    const SteadyTones tones = Find(pictures, FindShots(thumbnails).shot);
    std::printf("%s: %zu frames, flicker %.2f L, then %.2f\n",
                film,
                pictures.size(),
                tones.flicker_before,
                tones.flicker_after);
    EXPECT_LT(tones.flicker_after, 0.5 * tones.flicker_before);
  }
}

TEST(SteadyTonesTest, GivesFiniteCurvesForFlatFrames) {
  std::vector<Image> pictures;
  for (int i = 0; i < 8; ++i) pictures.push_back(Image(kWidth, kHeight, 1, i % 2 ? 100.0f : 0.0f));
  const SteadyTones tones = Find(pictures);
  for (const ToneCurve& curve : tones.curves) {
    for (size_t i = 0; i < curve.size(); ++i) {
      EXPECT_TRUE(std::isfinite(curve[i]) && curve[i] >= 0.0f && curve[i] <= 100.0f);
      EXPECT_GE(curve[i], curve[i > 0 ? i - 1 : 0]);
    }
  }
}

}  // namespace
}  // namespace color3d
