#include "core/scene/import/picture_notes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/files.h"
#include "core/image/codec.h"
#include "tests/support/formats/picture_files.h"

namespace color3d {
namespace {

using ::testing::ElementsAre;

TEST(PictureNotesTest, MergesEqualNotes) {
  const ScratchFolder folder;
  const Image picture(40, 30, 1, 0.5f), preview(10, 8, 1, 0.5f);
  const std::string scan = TiffFile({{.image = preview}, {.image = picture}});
  std::vector<View> views;
  for (const auto& [name, bytes] : {std::pair{"a.tif", scan},
                                    {"b.tif", scan},
                                    {"c.tif", scan},
                                    {"d.png", EncodePng8(picture)},
                                    {"e.png", WithPngProfile(EncodePng8(picture), "nonsense")}}) {
    WriteFileAtomic(folder.path() / name, bytes);
    View& view = views.emplace_back();
    view.name = name;
    view.image_file = name;
  }
  EXPECT_THAT(
      CollectPictureNotes(folder.path(), views, {}),
      ElementsAre("a.tif has 2 pages; the largest is read (40 x 30 px); the same of 2 more photos",
                  "e.png is read as sRGB: its colour profile is damaged"));
}

}  // namespace
}  // namespace color3d
