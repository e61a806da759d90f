#include "core/catalogue/scene_files.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(SceneFilesTest, RecognizesFilmsByExtension) {
  for (const char* film : {"walk.mp4",
                           "cams/left.MOV",
                           "00001.MTS",
                           "00001.m2ts",
                           "tape.dv",
                           "VTS_01_1.VOB",
                           "news.ts",
                           "phone.3gp",
                           "clip.flv",
                           "card.mxf",
                           "a.b.mpeg"}) {
    EXPECT_TRUE(HasFilmExtension(film)) << film;
  }
  for (const char* other : {"mp4", "walk", "walk.mp3", "walk.mp4.txt", "views.tsv", "", "."}) {
    EXPECT_FALSE(HasFilmExtension(other)) << other;
  }
}

TEST(SceneFilesTest, RecognizesSplatsByExtension) {
  for (const char* splat : {"a.ply", "b.SOG", "dir.x/c.Spz", ".ply"}) {
    EXPECT_TRUE(HasSplatExtension(splat)) << splat;
  }
  for (const char* other : {"ply", "aply", "a.ply/b", "a.plyx", "a.splat", ""}) {
    EXPECT_FALSE(HasSplatExtension(other)) << other;
  }
}

}  // namespace
}  // namespace color3d
