#include "client/lib/photos/film_advice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/lib/photos/photo_folder.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/probe/probe.h"

namespace color3d::client {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class FilmAdviceTest : public testing::Test {
 protected:
  void Write(const std::string& name) {
    fs::create_directories((folder_.path() / name).parent_path());
    WriteFileAtomic(folder_.path() / name, "bytes");
  }
  std::string Complaint(const std::string& name, bool as_frames = false) {
    try {
      CollectPhotos(folder_.path() / name, as_frames);
      return "";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
      return e.what();
    }
  }
  ScratchFolder folder_;
};

TEST_F(FilmAdviceTest, NamesFormatAndConversion) {
  Write("a.gif");
  EXPECT_THAT(Complaint("a.gif"),
              AllOf(HasSubstr("a.gif is an animated picture (GIF)"), HasSubstr("ffmpeg -i ")));
  Write("scan_0086400.dpx");
  EXPECT_THAT(Complaint("scan_0086400.dpx"),
              AllOf(HasSubstr("a picture in an unsupported format (DPX)"),
                    HasSubstr("-start_number 0086400 -i "),
                    HasSubstr("scan_%07d.dpx")));
  Write("A001.R3D");
  EXPECT_THAT(Complaint("A001.R3D"), HasSubstr("camera's raw film (RED)"));
  Write("live.m3u8");
  EXPECT_THAT(Complaint("live.m3u8"), HasSubstr("list of other files"));
  Write("old film's.rm");
  EXPECT_THAT(Complaint("old film's.rm"), HasSubstr(R"(old film'\''s.rm')"));
  Write("notes.txt");
  EXPECT_THAT(Complaint("notes.txt"), HasSubstr("is not a folder; give the folder"));
}

TEST_F(FilmAdviceTest, FolderNamesFirstFileOfKind) {
  for (const int i : {9, 10, 11}) Write("reel/scan" + std::to_string(i) + ".dpx");
  for (const bool as_frames : {false, true}) {
    EXPECT_THAT(Complaint("reel", as_frames),
                AllOf(HasSubstr("reel/scan9.dpx is a picture in an unsupported format (DPX), as "
                                "2 more are"),
                      HasSubstr("-start_number 9 -i "),
                      HasSubstr("scan%d.dpx")));
    EXPECT_THAT(Complaint("", as_frames),
                HasSubstr("reel/scan9.dpx is a picture in an unsupported format (DPX)"));
  }
  Write("clips/b.gif");
  EXPECT_THAT(Complaint("clips"), HasSubstr("clips/b.gif is an animated picture (GIF)"));
}

TEST_F(FilmAdviceTest, NamesPicturesInSubfolders) {
  Write("film/reel 1/frames/0001.png");
  Write("film/reel 1/frames/0002.png");
  EXPECT_THAT(Complaint("film"),
              HasSubstr("pictures lie in " + (folder_.path() / "film/reel 1/frames").string()));
  Write("reels/1/a.mp4");
  EXPECT_THAT(Complaint("reels"),
              HasSubstr("films lie in " + (folder_.path() / "reels/1").string()));
  Write("nothing/.hidden/1.gif");
  Write("nothing/@eaDir/thumbnail.jpg");
  EXPECT_THAT(Complaint("nothing"), testing::EndsWith("(" + ReadableImageFormats() + ")"));
}

TEST_F(FilmAdviceTest, DoesNotNameFolderItself) {
  Write("given/x.avif");
  fs::create_symlink("/nowhere", folder_.path() / "given/y.jpg");
  EXPECT_THAT(Complaint("given"), testing::Not(HasSubstr("give that folder")));
}

}  // namespace
}  // namespace color3d::client
