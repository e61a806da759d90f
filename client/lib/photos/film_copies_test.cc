#include "client/lib/photos/film_copies.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/lib/photos/photo_folder.h"
#include "core/base/files.h"

namespace color3d::client {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class FilmCopiesTest : public testing::Test {
 protected:
  void Write(const std::string& name, const std::string& bytes) {
    WriteFileAtomic(folder_.path() / name, bytes);
  }
  ScratchFolder folder_;
};

TEST_F(FilmCopiesTest, MergesCopiesOfFilm) {
  Write("film.mp4", "moving");
  Write("film (1).mp4", "moving");
  Write("Copy of film.mp4", "moving");
  for (const bool as_frames : {false, true}) {
    const PhotoFolder folder = CollectPhotos(folder_.path(), as_frames);
    ASSERT_TRUE(folder.film);
    EXPECT_EQ(folder.film->path, "film.mp4");
    EXPECT_THAT(folder.camera_films, IsEmpty());
    EXPECT_THAT(folder.notes,
                ElementsAre(HasSubstr("film (1).mp4 is the same film as film.mp4, byte for byte"),
                            HasSubstr("Copy of film.mp4 is the same film as film.mp4")));
  }
}

TEST_F(FilmCopiesTest, KeepsOtherFilms) {
  Write("left.mp4", "moving");
  Write("left2.mp4", "moving");
  Write("right.mp4", "movinG");
  const PhotoFolder folder = CollectPhotos(folder_.path());
  EXPECT_FALSE(folder.film);
  ASSERT_EQ(folder.camera_films.size(), 2u);
  EXPECT_EQ(folder.camera_films[0].path, "left.mp4");
  EXPECT_EQ(folder.camera_films[1].path, "right.mp4");
  EXPECT_EQ(folder.notes.size(), 1u);
}

// What a file of poses counts or names is not changed behind its back.
TEST_F(FilmCopiesTest, KeepsAllFilmsWithPoses) {
  Write("a.mp4", "moving");
  Write("b.mp4", "moving");
  Write("transforms.json", R"({"frames": [{"file_path": "a.mp4"}, {"file_path": "b.mp4"}]})");
  EXPECT_EQ(CollectPhotos(folder_.path()).camera_films.size(), 2u);
}

}  // namespace
}  // namespace color3d::client
