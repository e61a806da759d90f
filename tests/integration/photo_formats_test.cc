// Photos of phones, scanners and web pages, through client, server and a sandboxed worker; results
// in the folder of the photos.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/color/lab.h"
#include "core/image/codec.h"
#include "tests/integration/service_fixture.h"
#include "tests/support/formats/picture_files.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class PhotoFormatsTest : public ServiceTest {
 protected:
  void SetUp() override {
    StartServer();
    ProceduralSceneOptions options = SmallRoom(6);
    options.width = 160;
    options.height = 120;
    options.poses = ProceduralSceneOptions::Poses::kColmap;
    WriteProceduralScene(Path("room"), options);
  }

  // Replaces the photo `stem` by `bytes` with another ending, also in the model.
  void Replace(const std::string& stem, const std::string& ending, const std::string& bytes) {
    const fs::path images = Path("room") / "images";
    fs::remove(images / (stem + ".png"));
    std::ofstream(images / (stem + ending), std::ios::binary) << bytes;
    const fs::path model = Path("room") / "sparse" / "0" / "images.txt";
    std::string text = ReadFile(model);
    const size_t at = text.find(stem + ".png");
    ASSERT_NE(at, std::string::npos);
    WriteFileAtomic(model, text.replace(at, stem.size() + 4, stem + ending));
  }
  Image Photo(const std::string& stem) const {
    return ReadImage(Path("room") / "images" / (stem + ".png"));
  }
  // Runs `key select` of this view and returns its output.
  std::string Select(const std::string& view) {
    const ProcessResult result = Client({"key",
                                         "select",
                                         Path("room").string(),
                                         "--view",
                                         view,
                                         "-o",
                                         (Path("key") / view).string()});
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    return result.out + result.err;
  }
  // Mean difference in luminance between a key view and the original photo.
  double Difference(const std::string& view, const Image& photo) const {
    const Image key = LuminanceFromSrgb(ReadImage(Path("key") / view / "key_view.png"));
    const Image expected = LuminanceFromSrgb(photo);
    EXPECT_EQ(key.data.size(), expected.data.size()) << view;
    double sum = 0.0;
    for (size_t i = 0; i < std::min(key.data.size(), expected.data.size()); ++i) {
      sum += std::abs(key.data[i] - expected.data[i]);
    }
    return sum / static_cast<double>(key.data.size());
  }
};

TEST_F(PhotoFormatsTest, SandboxedWorkerReadsEveryFormat) {
  std::vector<Image> photos;
  for (int i = 0; i < 6; ++i) photos.push_back(Photo("view00" + std::to_string(i)));
  Replace("view000", ".webp", WebpFile(photos[0]));
  Replace("view001", ".bmp", BmpFile(photos[1]));
  Replace("view002",
          ".TIF",
          TiffFile({{.image = Resize(photos[2], 40, 30), .subfile_type = 1, .photometric = 2},
                    {.image = photos[2], .photometric = 2}}));
  // Equal tones, other pixel values.
  WriteFileAtomic(Path("room") / "images" / "view003.png",
                  WithPngProfile(EncodePng16(ConvertToProfile(photos[3], ProPhotoProfile())),
                                 ProPhotoProfile()));
  const std::string heic = HeicFile(photos[4]);
  if (!heic.empty()) Replace("view004", ".heic", heic);

  EXPECT_LT((Select("view000"), Difference("view000", photos[0])), 0.2);
  EXPECT_LT((Select("view001"), Difference("view001", photos[1])), 0.2);
  const std::string said = Select("view002");
  EXPECT_LT(Difference("view002", photos[2]), 0.2);
  EXPECT_NE(said.find("has 2 pages; the largest is read (160 x 120 px)"), std::string::npos)
      << said;
  EXPECT_LT((Select("view003"), Difference("view003", photos[3])), 0.3);
  if (!heic.empty()) {
    EXPECT_LT((Select("view004"), Difference("view004", photos[4])), 1.5);
  }
}

TEST_F(PhotoFormatsTest, ResultsBesidePhotosAreNotPhotos) {
  const std::string images = (Path("room") / "images").string();
  std::vector<std::string> scenes;
  for (int run = 0; run < 2; ++run) {
    for (const std::string& out : {images, Path("room").string()}) {
      const ProcessResult result =
          Client({"key", "select", Path("room").string(), "-o", out, "--json"});
      ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
      scenes.push_back(json::parse(result.out).at("scene"));
    }
  }
  for (const std::string& scene : scenes) EXPECT_EQ(scene, scenes[0]);
  // Live answers are named like the photos.
  ExpectRefusal(Client({"preview",
                        images,
                        "--key-color",
                        (Path("room") / "images" / "view000.png").string(),
                        "-o",
                        images}),
                2,
                {"-o", "folder of the photos"});
}

}  // namespace
}  // namespace color3d
