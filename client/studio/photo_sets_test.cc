#include "client/studio/photo_sets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d::client {
namespace {
namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class PhotoSetsTest : public ::testing::Test {
 protected:
  std::string Receive(const std::string& id, const std::string& name, bool is_whole = true) {
    try {
      sets_.Receive(id, name, [&](const PhotoSets::Sink& sink) {
        return sink("abc", 3) && sink("de", 2) && is_whole;
      });
    } catch (const Error& e) {
      return std::string(ErrorCodeName(e.code())) + " " + e.what();
    }
    return "";
  }
  const ScratchFolder scratch_;
  PhotoSets sets_{scratch_.path() / "studio"};
};

TEST_F(PhotoSetsTest, KeepsDroppedFiles) {
  const PhotoSet set = sets_.Create("Grandma/1932");
  EXPECT_EQ(set.folder.filename(), "Grandma_1932");
  EXPECT_EQ(Receive(set.id, "images/0001.jpg"), "");
  EXPECT_EQ(ReadFile(set.folder / "images/0001.jpg"), "abcde");
  EXPECT_EQ(Receive(set.id, "images/0001.jpg"), "") << "dropped again";
  EXPECT_THAT(Receive(set.id, "images/0002.jpg", false), HasSubstr("ABORTED"));
  EXPECT_THAT(ListFiles(set.folder), ElementsAre("images/0001.jpg"));
  // A part of a file that did not arrive whole is gone.
  EXPECT_EQ(std::distance(fs::directory_iterator(set.folder.parent_path().parent_path()), {}), 2);
}

TEST_F(PhotoSetsTest, RefusesPathsOutside) {
  const PhotoSet set = sets_.Create("");
  for (const char* name :
       {"../a.jpg", "/etc/a.jpg", "a/../../b.jpg", "", "a\\b.jpg", "a\nb.jpg", "."}) {
    EXPECT_THAT(Receive(set.id, name), HasSubstr("INVALID_ARGUMENT")) << name;
  }
  fs::create_symlink(scratch_.path(), set.folder / "link");
  EXPECT_THAT(Receive(set.id, "link/a.jpg"), HasSubstr("FAILED_PRECONDITION"));
  EXPECT_THAT(Receive("../studio", "a.jpg"), HasSubstr("NOT_FOUND"));
  EXPECT_THAT(Receive("0000", "a.jpg"), HasSubstr("NOT_FOUND"));
}

TEST_F(PhotoSetsTest, AdoptsFolderWithoutCopying) {
  const fs::path photos = scratch_.path() / "photos";
  fs::create_directories(photos);
  const PhotoSet set = sets_.Adopt(photos);
  EXPECT_EQ(set.name, "photos");
  EXPECT_EQ(set.folder, fs::canonical(photos));
  sets_.SetScene(set.id, "scenes/1");
  EXPECT_EQ(sets_.Adopt(photos / ".").id, set.id);
  EXPECT_EQ(sets_.Get(set.id).scene, "scenes/1");
  EXPECT_THAT(Receive(set.id, "a.jpg"), HasSubstr("FAILED_PRECONDITION"));
  EXPECT_EQ(sets_.List().size(), 1u);
  EXPECT_THROW(sets_.Adopt(scratch_.path() / "nothing"), Error);
}

TEST_F(PhotoSetsTest, OutlivesItself) {
  const std::string id = sets_.Create("a").id;
  const fs::path picture = sets_.KeepPicture(id, ".png", "bytes");
  const PhotoSets again(scratch_.path() / "studio");
  EXPECT_EQ(again.Get(id).name, "a");
  EXPECT_EQ(ReadFile(picture), "bytes");
  EXPECT_EQ(again.KeptPicture(id, picture.filename()), picture);
  EXPECT_THROW(again.KeptPicture(id, "set.json"), Error);
  EXPECT_THROW(again.KeptPicture(id, "../" + picture.filename().string()), Error);
  std::ofstream(scratch_.path() / "studio" / id / "set.json") << "{";
  EXPECT_TRUE(again.List().empty());
  EXPECT_THROW(again.Get(id), Error);
}

}  // namespace
}  // namespace color3d::client
