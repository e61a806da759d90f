#include "core/splat/import/splat_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/splat/export/sog/sog.h"
#include "core/splat/export/spz/spz.h"
#include "core/zip/gzip.h"
#include "core/zip/zip.h"
#include "tests/support/scenes/splat_files.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

std::string Refusal(const std::string& bytes, SplatSource source = {}) {
  source.name = "scene.x";
  try {
    ReadSplat(bytes, source);
  } catch (const Error& e) {
    EXPECT_TRUE(e.code() == ErrorCode::kInvalidArgument ||
                e.code() == ErrorCode::kResourceExhausted);
    EXPECT_THAT(e.what(), HasSubstr("scene.x"));
    return e.what();
  }
  return "";
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string Header(const std::string& elements) {
  return "ply\nformat binary_little_endian 1.0\n" + elements + "end_header\n";
}

TEST(SplatFileTest, ReadsPlyExactly) {
  for (const int degree : {0, 1, 2, 3}) {
    const ViewerGaussians g = BallOnGround(7, 0.3f, degree);
    const ViewerGaussians file = ReadSplat(SplatPly(g));
    EXPECT_EQ(file.sh_degree, degree);
    EXPECT_EQ(file.position, g.position);
    EXPECT_EQ(file.log_scale, g.log_scale);
    EXPECT_EQ(file.rotation, g.rotation);
    EXPECT_EQ(file.opacity_logit, g.opacity_logit);
    EXPECT_EQ(file.sh, g.sh);
  }
}

TEST(SplatFileTest, ReadsPlyVariants) {
  std::string text = Header(
      "comment by another program\nelement vertex 1\nproperty uchar red\nproperty uchar green\n"
      "property uchar blue\nproperty double x\nproperty float y\nproperty float z\n"
      "property float opacity\nproperty float scale_0\nproperty float scale_1\n"
      "property float scale_2\nproperty float rot_0\nproperty float rot_1\nproperty float rot_2\n"
      "property float rot_3\nelement extra 3\nproperty list uchar int data\n");
  for (size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2) {
    text.replace(at, 1, "\r\n");
  }
  text += std::string("\xff\x80\x00", 3);
  const double x = 1.5;
  text.append(reinterpret_cast<const char*>(&x), 8);
  for (const float v : {2.0f, 3.0f, 0.5f, -1.0f, -2.0f, -3.0f, 1.0f, 0.0f, 0.0f, 0.0f}) {
    text.append(reinterpret_cast<const char*>(&v), 4);
  }
  const ViewerGaussians g = ReadSplat("ply" + text.substr(3) + "more");
  ASSERT_EQ(g.size(), 1u);
  EXPECT_EQ(g.position, (std::vector<float>{1.5f, 2.0f, 3.0f}));
  EXPECT_EQ(g.log_scale[2], -3.0f);
  EXPECT_NEAR(0.5f + kShDc * g.sh[0], 1.0f, 1e-6);
  EXPECT_NEAR(0.5f + kShDc * g.sh[1], 128.0f / 255.0f, 1e-6);
  EXPECT_NEAR(0.5f + kShDc * g.sh[2], 0.0f, 1e-6);
}

TEST(SplatFileTest, RejectsUnsupportedPly) {
  const std::string ply = SplatPly(BallOnGround(5, 0.0f, 1));
  EXPECT_THAT(Refusal(Header("element vertex 8\nproperty float x\nproperty float y\n"
                             "property float z\nelement face 6\n"
                             "property list uchar int vertex_indices\n") +
                      std::string(500, '\0')),
              HasSubstr("mesh"));
  EXPECT_THAT(Refusal(Header("element vertex 8\nproperty float x\nproperty float y\n"
                             "property float z\nproperty uchar red\n") +
                      std::string(500, '\0')),
              HasSubstr("point cloud"));
  EXPECT_THAT(Refusal(Replaced(ply, "property float scale_2\n", "property float scale_9\n")),
              HasSubstr("no scale_2"));
  EXPECT_THAT(Refusal(Replaced(ply, "binary_little_endian", "ascii")), HasSubstr("ascii"));
  EXPECT_THAT(Refusal(Replaced(ply, "f_rest_8", "f_rest_x")), HasSubstr("8 properties f_rest"));
  EXPECT_THAT(Refusal(Replaced(ply,
                               "element vertex",
                               "element chunk 1\nproperty float min_x\n"
                               "element vertex")),
              HasSubstr("SuperSplat"));
  EXPECT_THAT(Refusal(Replaced(ply, "vertex 5", "vertex five")), HasSubstr("'five'"));
  EXPECT_THAT(Refusal(Replaced(ply, "float x", "list uchar int x")), HasSubstr("list"));
  EXPECT_THAT(Refusal(Header("")), HasSubstr("without vertices"));
  EXPECT_THAT(Refusal("ply\nformat"), HasSubstr("cut short"));
  EXPECT_THAT(Refusal(ply.substr(0, ply.size() - 1)), HasSubstr("ends after 4 of its 5"));
}

TEST(SplatFileTest, ChecksSizesBeforeAllocating) {
  const std::string ply = SplatPly(BallOnGround(5));
  for (const char* count : {"4000000000", "18446744073709551615"}) {
    EXPECT_THAT(Refusal(Replaced(ply, "vertex 5", std::string("vertex ") + count)),
                HasSubstr("ends after"));
  }
  SplatSource few;
  few.max_gaussians = 4;
  few.remedy = "take fewer";
  EXPECT_THAT(Refusal(ply, few), HasSubstr("holds 5 Gaussians; at most 4"));
  EXPECT_THAT(Refusal(ply, few), HasSubstr("take fewer"));
  ThreadPool pool(1);
  EXPECT_THAT(Refusal(EncodeSog(BallOnGround(5), pool), few), HasSubstr("at most 4"));
  for (const SpzVersion version : {SpzVersion::k2, SpzVersion::k4}) {
    EXPECT_THAT(Refusal(EncodeSpz(BallOnGround(5), version, pool), few), HasSubstr("at most 4"));
  }
  // A header of SPZ 2 that claims 4 billion Gaussians in a hundred bytes.
  std::string header("NGSP\x02\0\0\0\xff\xff\xff\xff\0\x0c\0\0", 16);
  EXPECT_THAT(Refusal(Gzip(header + std::string(1000, '\0'))), HasSubstr("cut short"));
}

TEST(SplatFileTest, RejectsEveryTruncation) {
  ThreadPool pool(1);
  const ViewerGaussians g = BallOnGround(40, 0.2f, 1);
  for (const std::string& bytes : {SplatPly(g),
                                   EncodeSog(g, pool),
                                   EncodeSpz(g, SpzVersion::k2, pool),
                                   EncodeSpz(g, SpzVersion::k4, pool)}) {
    ASSERT_EQ(ReadSplat(bytes).size(), 40u);
    for (size_t size = 0; size + 1 < bytes.size(); size += 1 + bytes.size() / 97) {
      EXPECT_NE(Refusal(bytes.substr(0, size)), "") << size << " of " << bytes.size();
    }
  }
}

TEST(SplatFileTest, NamesUnsupportedVersion) {
  ThreadPool pool(1);
  const std::string meta = R"({"means":{"shape":[2,3]}})";
  EXPECT_THAT(Refusal(StoredZip({{"meta.json", meta}})), HasSubstr("SOG of version 1"));
  EXPECT_THAT(Refusal(StoredZip({{"meta.json", R"({"version":3,"count":1})"}})),
              HasSubstr("SOG of version 3"));
  EXPECT_THAT(Refusal(StoredZip({{"meta.json", R"({"version":2})"}})), HasSubstr("count"));
  EXPECT_THAT(Refusal(StoredZip({{"meta.json", "{"}})), HasSubstr("not valid JSON"));
  EXPECT_THAT(Refusal(StoredZip({{"photo.jpg", "x"}})), HasSubstr("without meta.json"));
  std::string spz = EncodeSpz(BallOnGround(5), SpzVersion::k4, pool);
  spz[4] = 5;
  EXPECT_THAT(Refusal(spz), HasSubstr("SPZ of version 5"));
  EXPECT_THAT(Refusal(Gzip(std::string("NGSP\x01\0\0\0\x01\0\0\0\0\0\0\0", 16))),
              HasSubstr("SPZ of version 1"));
  EXPECT_THAT(Refusal(Gzip("a text, packed, of more than 16 bytes")), HasSubstr("not an SPZ"));
}

// Files outside the archive are not read.
TEST(SplatFileTest, DoesNotReadFilesOutsideArchive) {
  const ScratchFolder folder;
  const std::filesystem::path outside = folder.path() / "means.webp";
  WriteFileAtomic(outside, "RIFF");
  for (const std::string& name : {outside.string(), std::string("../means.webp"), std::string()}) {
    const std::string files = "[\"" + name + "\",\"" + name + "\"]";
    const std::string meta = R"({"version":2,"count":1,"means":{"mins":[0,0,0],"maxs":[1,1,1],)"
                             R"("files":)" +
                             files + R"(},"scales":{"codebook":[0],"files":)" + files +
                             R"(},"quats":{"files":)" + files +
                             R"(},"sh0":{"codebook":[0],"files":)" + files + "}}";
    EXPECT_THAT(Refusal(StoredZip({{"meta.json", meta}})), HasSubstr("there is no record"));
  }
}

TEST(SplatFileTest, SpzVersion3UsesRotationsOfVersion4) {
  ThreadPool pool(1);
  const ViewerGaussians g = BallOnGround(20);
  const std::string four = EncodeSpz(g, SpzVersion::k4, pool);
  const ViewerGaussians expected = ReadSpz(four);
  // The same streams after the older header: positions, opacities, colours, scales, rotations.
  std::string three("NGSP\x03\0\0\0\x14\0\0\0", 12);
  three += four.substr(12, 2) + std::string(2, '\0');
  const auto byte = [&](double value) { three += static_cast<char>(std::lround(value)); };
  for (size_t i = 0; i < 60; ++i) {
    const double axis = i % 3 == 0 ? 1.0 : -1.0;
    const auto fixed = static_cast<int32_t>(
        std::lround(std::ldexp(axis * expected.position[i], static_cast<uint8_t>(four[13]))));
    for (int k = 0; k < 3; ++k) three += static_cast<char>(fixed >> (8 * k));
  }
  for (const float logit : expected.opacity_logit) byte(255.0 / (1.0 + std::exp(-logit)));
  for (const float sh : expected.sh) byte(255.0 * (0.15 * sh + 0.5));
  for (const float scale : expected.log_scale) byte(16.0 * (scale + 10.0));
  for (int i = 0; i < 20; ++i) three += std::string("\0\0\0\xc0", 4);  // w is omitted: identity
  const ViewerGaussians g3 = ReadSpz(Gzip(three));
  EXPECT_EQ(g3.position, expected.position);
  EXPECT_EQ(g3.log_scale, expected.log_scale);
  EXPECT_EQ(g3.sh, expected.sh);
  EXPECT_NEAR(g3.rotation[0], 1.0f, 1e-6);
}

TEST(SplatFileTest, NamesFileThatIsNoSplat) {
  EXPECT_THAT(Refusal(""), HasSubstr("empty"));
  EXPECT_THAT(Refusal("\x89PNG...."), HasSubstr("PNG picture"));
  EXPECT_THAT(Refusal("glTF...."), HasSubstr("glTF"));
  EXPECT_THAT(Refusal("some text"), HasSubstr("not a readable splat"));
}

}  // namespace
}  // namespace color3d
