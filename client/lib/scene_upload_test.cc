#include "client/lib/scene_upload.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d::client {
namespace {

TEST(SceneUploadTest, NamesTooLargeFilmBeforeReadingIt) {
  constexpr int64_t kMost = int64_t{8} << 30;
  const ScratchFolder folder;
  const std::filesystem::path film = folder.path() / "reel.mov";
  WriteFileAtomic(film, "a film");
  std::filesystem::resize_file(film, kMost + 1);  // sparse: takes no disk space
  try {
    BuildManifest(CollectPhotos(film), kMost, CancellationToken());
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(e.what(),
                testing::AllOf(testing::HasSubstr("reel.mov has 8.6 GB"),
                               testing::HasSubstr("cut it into parts")));
  }
}

}  // namespace
}  // namespace color3d::client
