// Unusable scenes are refused with a message of one line, and the server continues.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/base/random.h"
#include "core/image/codec.h"
#include "tests/integration/service_fixture.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// No test here trains a model.
constexpr std::chrono::seconds kLimit{150};

class BadPhotosTest : public ServiceTest {
 protected:
  void SetUp() override { StartServer(); }

  // Four photos with or without poses.
  fs::path Room(ProceduralSceneOptions::Poses poses) {
    ProceduralSceneOptions options = SmallRoom(4);
    options.width = 160;
    options.height = 120;
    options.poses = poses;
    WriteProceduralScene(Path("room"), options);
    return Path("room");
  }
  fs::path PosedRoom() { return Room(ProceduralSceneOptions::Poses::kColmap); }
  fs::path BareRoom() { return Room(ProceduralSceneOptions::Poses::kNone); }

  ProcessResult Colorize(const fs::path& folder) {
    return Client(
        std::vector<std::string>{
            "colorize", folder.string(), "-o", Path("out").string(), "--benchmark"} +
            QuickOptions(),
        kLimit);
  }
};

void Overwrite(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

void ReplaceFirst(const fs::path& path, const std::string& from, const std::string& to) {
  std::string text = ReadFile(path);
  const size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos);
  Overwrite(path, text.replace(at, from.size(), to));
}

// CRC-32 of a chunk's type and data, as PNG stores it.
std::string PngChecksum(const std::string& bytes) {
  uint32_t crc = 0xFFFFFFFFu;
  for (unsigned char byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1u) ^ ((crc & 1u) != 0 ? 0xEDB88320u : 0u);
  }
  crc = ~crc;
  std::string big_endian;
  for (int shift = 24; shift >= 0; shift -= 8) big_endian += static_cast<char>(crc >> shift);
  return big_endian;
}

TEST_F(BadPhotosTest, RefusesMissingFolder) {
  ExpectRefusal(Colorize(Path("nowhere")), 2, {"nowhere"});
}

TEST_F(BadPhotosTest, RefusesEmptyFolder) {
  fs::create_directories(Path("empty"));
  ExpectRefusal(Colorize(Path("empty")), 2, {"empty", "no photo"});
}

TEST_F(BadPhotosTest, RefusesSinglePhoto) {
  const fs::path room = BareRoom();
  for (const char* name : {"view001.png", "view002.png", "view003.png"}) {
    fs::remove(room / "images" / name);
  }
  ExpectRefusal(Colorize(room), 2, {"one photo", "view000.png"});
}

TEST_F(BadPhotosTest, RefusesTextFileNamedJpg) {
  const fs::path room = BareRoom();
  Overwrite(room / "images" / "notes.jpg", "This is a list of things to photograph.\n");
  ExpectRefusal(Colorize(room), 2, {"notes.jpg", "not an image"});
}

TEST_F(BadPhotosTest, RefusesTruncatedJpeg) {
  const fs::path room = BareRoom();
  const std::string jpeg = EncodeJpeg(ReadImage(room / "images" / "view000.png"));
  Overwrite(room / "images" / "cut.jpg", jpeg.substr(0, jpeg.size() * 2 / 3));
  ExpectRefusal(Colorize(room), 2, {"cut.jpg", "truncated"});
}

TEST_F(BadPhotosTest, RefusesPngOfTwentyBytes) {
  const fs::path room = BareRoom();
  // Signature, length and type of IHDR, and half of it: 60000 px wide.
  std::string bytes("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\xea\x60", 20);
  ASSERT_EQ(bytes.size(), 20u);
  Overwrite(room / "images" / "bomb.png", bytes);
  ExpectRefusal(Colorize(room), 2, {"bomb.png"});
}

TEST_F(BadPhotosTest, RefusesPngHeaderOf60000By60000Px) {
  const fs::path room = BareRoom();
  std::string png = ReadFile(room / "images" / "view000.png");
  const std::string side("\0\0\xea\x60", 4);
  png.replace(16, 8, side + side);
  png.replace(29, 4, PngChecksum(png.substr(12, 17)));
  Overwrite(room / "images" / "bomb.png", png);
  const ProcessResult result = Colorize(room);
  EXPECT_TRUE(result.exit_code == 2 || result.exit_code == 4) << result.exit_code;
  ExpectRefusal(result, result.exit_code, {"bomb.png", "60000"});
}

TEST_F(BadPhotosTest, RefusesPhotoOfOtherShapeThanCamera) {
  const fs::path room = PosedRoom();
  const Image photo = ReadImage(room / "images" / "view002.png");
  Overwrite(room / "images" / "view002.png", EncodePng8(Resize(photo, 120, 160)));
  ExpectRefusal(Colorize(room), 2, {"view002.png", "120", "160"});
}

TEST_F(BadPhotosTest, RefusesModelWithoutPhotos) {
  const fs::path room = PosedRoom();
  for (const std::string view : {"1", "2", "3"}) {
    fs::rename(room / "images" / ("view00" + view + ".png"),
               room / "images" / ("x" + view + ".png"));
  }
  ExpectRefusal(Colorize(room), 2, {"view001.png", "1 are among those given"});
}

TEST_F(BadPhotosTest, RefusesNanInPoints) {
  const fs::path room = PosedRoom();
  const fs::path points = room / "sparse" / "0" / "points3D.txt";
  std::string text = ReadFile(points);
  const size_t line = text.find("\n7 ");
  ASSERT_NE(line, std::string::npos);
  const size_t end = text.find(' ', line + 3);
  Overwrite(points, text.replace(line + 3, end - line - 3, "nan"));
  ExpectRefusal(Colorize(room), 2, {"points3D.txt"});
}

TEST_F(BadPhotosTest, RefusesPoseWithoutRotation) {
  const fs::path room = PosedRoom();
  const fs::path images = room / "sparse" / "0" / "images.txt";
  const std::string text = ReadFile(images);
  const size_t line = text.find("\n2 ");
  ASSERT_NE(line, std::string::npos);
  size_t end = line + 3;
  for (int i = 0; i < 4; ++i) end = text.find(' ', end) + 1;
  ReplaceFirst(images, text.substr(line, end - line), "\n2 0 0 0 0 ");
  ExpectRefusal(Colorize(room), 2, {"images.txt"});
}

TEST_F(BadPhotosTest, RefusesIncompleteModel) {
  const fs::path room = PosedRoom();
  fs::remove(room / "sparse" / "0" / "cameras.txt");
  ExpectRefusal(Colorize(room), 2, {"cameras"});
}

TEST_F(BadPhotosTest, RefusesBenchmarkOfMonochromePhotos) {
  ProceduralSceneOptions options = SmallRoom(4, /*gray=*/true);
  options.width = 160;
  options.height = 120;
  WriteProceduralScene(Path("gray"), options);
  ExpectRefusal(Colorize(Path("gray")), 2, {"colour"});
}

// COLMAP runs and finds no matches, which the note states.
TEST_F(BadPhotosTest, NamesPhotosWithoutOverlap) {
  fs::create_directories(Path("noise"));
  for (int i = 0; i < 5; ++i) {
    Random random(static_cast<uint64_t>(i + 1));
    Image coarse(32, 24, 3);
    for (float& value : coarse.data) value = static_cast<float>(random.NextUniform(0.1, 0.9));
    Overwrite(Path("noise") / ("photo" + std::to_string(i) + ".png"),
              EncodePng8(Resize(coarse, 320, 240)));
  }
  const ProcessResult result = Colorize(Path("noise"));
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("of 5 photos could be placed"));
  EXPECT_THAT(result.err, HasSubstr("overlap by 60 %"));
}

}  // namespace
}  // namespace color3d
