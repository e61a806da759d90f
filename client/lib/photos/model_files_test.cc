#include "client/lib/photos/model_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d::client {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class ModelFilesTest : public ::testing::Test {
 protected:
  void Write(const std::string& path, const std::string& bytes = "x") {
    fs::create_directories((root() / path).parent_path());
    WriteFileAtomic(root() / path, bytes);
  }
  void WritePhotos(const std::string& folder) {
    for (const char* name : {"a.jpg", "b.jpg"}) Write(folder + name);
  }
  void WriteModel(const std::string& folder) {
    for (const char* stem : {"cameras", "images", "points3D"}) {
      Write(folder + "/" + stem + ".bin");
    }
  }
  fs::path root() const { return scratch_.path() / "scene"; }

  static std::vector<std::string> Paths(const std::vector<LocalFile>& files) {
    std::vector<std::string> paths;
    for (const LocalFile& file : files) paths.push_back(file.path);
    return paths;
  }
  std::string ErrorOf() {
    try {
      CollectPhotos(root());
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }

 private:
  ScratchFolder scratch_;
};

TEST_F(ModelFilesTest, SendsAllCompleteModels) {
  WritePhotos("images/");
  WriteModel("sparse/0");
  WriteModel("sparse/1");
  Write("sparse/2/cameras.bin");  // an incomplete model
  EXPECT_THAT(Paths(CollectPhotos(root()).model_files),
              ElementsAre("sparse/0/cameras.bin",
                          "sparse/0/images.bin",
                          "sparse/0/points3D.bin",
                          "sparse/1/cameras.bin",
                          "sparse/1/images.bin",
                          "sparse/1/points3D.bin"));
}

TEST_F(ModelFilesTest, FindsModelInAnyUsualPlace) {
  WritePhotos("images/");
  for (const std::string place :
       {"sparse/1", "colmap/sparse/0", "colmap/sparse/2", "dense/sparse", "mine"}) {
    WriteModel(place);
    EXPECT_THAT(
        Paths(CollectPhotos(root()).model_files),
        ElementsAre(place + "/cameras.bin", place + "/images.bin", place + "/points3D.bin"));
    fs::remove_all(root() / place);
  }
  // Also behind a link.
  fs::remove_all(root() / "sparse");
  WriteModel("elsewhere");
  fs::rename(root() / "elsewhere", root().parent_path() / "elsewhere");
  fs::create_directory_symlink(root().parent_path() / "elsewhere", root() / "sparse");
  EXPECT_EQ(CollectPhotos(root()).model_files.size(), 3u);
}

TEST_F(ModelFilesTest, NamesUnsupportedPoses) {
  WritePhotos("");
  EXPECT_THAT(CollectPhotos(root()).notes, IsEmpty());
  Write("Cameras.xml");
  EXPECT_THAT(CollectPhotos(root()).notes,
              ElementsAre(AllOf(HasSubstr("the poses in Cameras.xml (Agisoft Metashape)"),
                                HasSubstr("will be estimated"))));
  WriteModel("sparse");
  EXPECT_THAT(CollectPhotos(root()).notes, IsEmpty());
}

TEST_F(ModelFilesTest, SendsPosesBoundsWithPhotos) {
  WritePhotos("images/");
  Write("poses_bounds.npy");
  EXPECT_THAT(Paths(CollectPhotos(root()).model_files), ElementsAre("poses_bounds.npy"));
  WriteModel("sparse/0");
  EXPECT_EQ(CollectPhotos(root()).model_files.size(), 3u);
}

TEST_F(ModelFilesTest, SendsPointsWithTransforms) {
  WritePhotos("images/");
  Write("sparse_pc.ply");
  EXPECT_THAT(CollectPhotos(root()).model_files, IsEmpty());
  for (const char* named : {"./cloud.ply", "/home/me/cloud.ply", ".\\\\cloud.ply"}) {
    Write("transforms.json",
          std::string("\xef\xbb\xbf{\"a\": NaN, \"ply_file_path\": \"") + named +
              "\", \"frames\": [],}");
    fs::remove(root() / "cloud.ply");
    EXPECT_THAT(Paths(CollectPhotos(root()).model_files),
                ElementsAre("sparse_pc.ply", "transforms.json"));
    Write("cloud.ply");
    EXPECT_THAT(Paths(CollectPhotos(root()).model_files),
                ElementsAre("cloud.ply", "transforms.json"));
  }
  // Files outside of the folder are never sent.
  WriteFileAtomic(root().parent_path() / "outside.ply", "x");
  Write("transforms.json", R"({"ply_file_path": "../outside.ply", "frames": []})");
  EXPECT_THAT(Paths(CollectPhotos(root()).model_files),
              ElementsAre("sparse_pc.ply", "transforms.json"));
}

TEST_F(ModelFilesTest, FindsPhotosOfBlenderTransforms) {
  WritePhotos("train/");
  Write("test/c.png");
  Write("transforms_train.json", R"({"frames": [{"file_path": "./train/a"}]})");
  Write("transforms_test.json", R"({"frames": [{"file_path": "test\\c"}]})");
  PhotoFolder folder = CollectPhotos(root());
  EXPECT_THAT(Paths(folder.photos), ElementsAre("test/c.png", "train/a.jpg", "train/b.jpg"));
  EXPECT_THAT(Paths(folder.model_files),
              ElementsAre("transforms_test.json", "transforms_train.json"));
  folder = CollectPhotos(root() / "train");
  EXPECT_THAT(folder.notes,
              ElementsAre(AllOf(HasSubstr("transforms_train.json are not used"),
                                HasSubstr("give " + root().string()))));
}

TEST_F(ModelFilesTest, AdviceKeepsPoses) {
  WritePhotos("Images/");
  WriteModel("sparse/0");
  PhotoFolder folder = CollectPhotos(root());
  EXPECT_THAT(Paths(folder.photos), ElementsAre("images/a.jpg", "images/b.jpg"));
  EXPECT_EQ(folder.photos[0].file, root() / "Images/a.jpg");
  EXPECT_EQ(folder.model_files.size(), 3u);
  // Advice about the folder of photos includes the poses.
  EXPECT_THAT(CollectPhotos(root() / "Images").notes,
              ElementsAre(HasSubstr("to use them, give " + root().string())));
  fs::rename(root() / "Images", root() / "scans");
  folder = CollectPhotos(root());
  EXPECT_THAT(Paths(folder.photos), ElementsAre("images/a.jpg", "images/b.jpg"));
  EXPECT_EQ(folder.model_files.size(), 3u);
  // A folder of thumbnails is no second folder of photos.
  WritePhotos("@eaDir/");
  EXPECT_EQ(CollectPhotos(root()).photos.size(), 2u);
  WritePhotos("other/");
  EXPECT_THAT(ErrorOf(),
              AllOf(HasSubstr("belong into " + (root() / "images").string()),
                    Not(HasSubstr("did you mean"))));
}

}  // namespace
}  // namespace color3d::client
