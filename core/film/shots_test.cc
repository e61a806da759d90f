#include "core/film/shots.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/video/film_reader.h"

namespace color3d {
namespace {

using testing::ElementsAre;

// A different place for each `seed`. `shift`: of the camera, px; `gain`: exposure.
Image Place(int seed, double shift, double gain = 1.0) {
  Image image(64, 40, 1);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double u = x + shift, v = y;
      double l = 50.0;
      for (int k = 1; k <= 4; ++k) {
        const double a = 1.7 * seed + 2.3 * k;
        l += 9.0 * std::sin(0.13 * k * (u * std::cos(a) + v * std::sin(a)) + 3.1 * a);
      }
      image.At(0, y, x) = static_cast<float>(gain * l);
    }
  }
  return image;
}

TEST(ShotsTest, FindsCutsAndIgnoresMotion) {
  std::vector<Image> frames;
  for (int i = 0; i < 10; ++i) frames.push_back(Place(1, 1.5 * i));
  for (int i = 0; i < 7; ++i) frames.push_back(Place(2, -2.5 * i));
  frames.push_back(Place(3, 0));
  for (int i = 0; i < 8; ++i) frames.push_back(Place(4, 0));
  const FilmShots shots = FindShots(frames);
  EXPECT_EQ(shots.count, 4);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(shots.shot[i], 0) << i;
  for (int i = 10; i < 17; ++i) EXPECT_EQ(shots.shot[i], 1) << i;
  EXPECT_EQ(shots.shot[17], 2);
  for (int i = 18; i < 26; ++i) EXPECT_EQ(shots.shot[i], 3) << i;
  EXPECT_THAT(shots.fault, testing::Each(FrameFault::kNone));
  EXPECT_THAT(shots.cuts, ElementsAre(10, 17, 18));
}

TEST(ShotsTest, KeepsShotsAcrossFaultyFrames) {
  std::vector<Image> frames;
  for (int i = 0; i < 12; ++i) frames.push_back(Place(1, i, 1.0 + 0.2 * (i % 2)));  // it flickers
  frames[3] = Image(64, 40, 1, 0.5f);
  frames[4] = Image(64, 40, 1, 99.0f);
  frames[8] = Place(9, 0);
  const FilmShots shots = FindShots(frames);
  EXPECT_EQ(shots.fault[3], FrameFault::kBlank);
  EXPECT_EQ(shots.fault[4], FrameFault::kBlank);
  EXPECT_EQ(shots.fault[8], FrameFault::kAlien);
  EXPECT_EQ(shots.count, 4);
  for (const int i : {0, 1, 2, 5, 6, 7, 9, 10, 11}) EXPECT_EQ(shots.shot[i], 0) << i;
  EXPECT_EQ(shots.shot[3], 1);
  EXPECT_EQ(shots.shot[4], 2);
  EXPECT_EQ(shots.shot[8], 3);
}

TEST(ShotsTest, KeepsShotsAcrossTwoTornFrames) {
  for (const int second : {9, 10}) {  // two equal or different torn frames
    std::vector<Image> frames;
    for (int i = 0; i < 14; ++i) frames.push_back(Place(1, i));
    frames[5] = Place(9, 0);
    frames[6] = Place(second, 1);
    const FilmShots shots = FindShots(frames);
    EXPECT_EQ(shots.fault[5], FrameFault::kAlien) << second;
    EXPECT_EQ(shots.fault[6], FrameFault::kAlien) << second;
    EXPECT_EQ(shots.count, 3) << second;
    for (const int i : {0, 4, 7, 13}) EXPECT_EQ(shots.shot[i], 0) << second;
  }
}

TEST(ShotsTest, FindsShortShots) {
  std::vector<Image> frames;
  for (int i = 0; i < 8; ++i) frames.push_back(Place(1, i));
  for (int i = 0; i < 2; ++i) frames.push_back(Place(9, i));
  for (int i = 0; i < 8; ++i) frames.push_back(Place(3, i));
  const FilmShots shots = FindShots(frames);
  EXPECT_EQ(shots.count, 3);
  EXPECT_THAT(shots.fault, testing::Each(FrameFault::kNone));
}

TEST(ShotsTest, AcceptsFewFramesAndRefusesBadOnes) {
  EXPECT_EQ(FindShots({}).count, 0);
  EXPECT_EQ(FindShots({Place(1, 0)}).count, 1);
  EXPECT_EQ(FindShots({Image(64, 40, 1, 0.0f)}).count, 1);
  EXPECT_THAT(FindShots({Place(1, 0), Place(1, 1)}).shot, ElementsAre(0, 0));
  EXPECT_THROW(FindShots({Place(1, 0), Image(64, 41, 1)}), Error);
  EXPECT_THROW(FindShots({Image(64, 40, 3)}), Error);
}

// Real films; cuts were counted by eye.
TEST(ShotsTest, CountsCutsOfRealFilms) {
  const std::filesystem::path data = std::filesystem::path(COLOR3D_SHARED_DATA);
  if (!std::filesystem::exists(data / "video")) GTEST_SKIP() << "no films";
  const auto look = [](const Image& srgb) {
    return LuminanceFromSrgb(FitWithin(srgb, kShotThumbnailPx));
  };
  const auto told = [](const std::string& name, const std::vector<Image>& thumbnails) {
    const FilmShots shots = FindShots(thumbnails);
    std::string cuts;
    for (size_t i = 1; i < shots.shot.size(); ++i) {
      if (shots.shot[i] != shots.shot[i - 1]) cuts += " " + std::to_string(i);
    }
    std::printf("%s: %zu frames, %d shots, cuts before%s\n",
                name.c_str(),
                thumbnails.size(),
                shots.count,
                cuts.empty() ? " none" : cuts.c_str());
    return shots.count;
  };
  for (const char* name : {"video/lady_running",
                           "video/man_walking",
                           "video/athlete4cam/cam01",
                           "historic/film_001",
                           "historic/film_002",
                           "historic/film_003"}) {
    if (!std::filesystem::exists(data / name)) continue;
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(data / name)) {
      if (HasImageExtension(entry.path().string())) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    std::vector<Image> thumbnails;
    for (const auto& file : files) thumbnails.push_back(look(ReadImage(file)));
    EXPECT_EQ(told(name, thumbnails), 1) << name;
  }
  for (const auto& [name, count] :
       {std::pair{"bikes.mp4", 6}, {"carphone_pristine.mp4", 1}, {"pi3_skating.mp4", 1}}) {
    if (!std::filesystem::exists(data / "video/clips" / name)) continue;
    FilmReader film(data / "video/clips" / name);
    std::vector<Image> thumbnails;
    for (size_t i = 0; i < film.times().size(); ++i) {
      thumbnails.push_back(look(film.Read(static_cast<int>(i))));
    }
    EXPECT_EQ(told(name, thumbnails), count) << name;
  }
}

}  // namespace
}  // namespace color3d
