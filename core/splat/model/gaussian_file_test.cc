#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "tests/support/scenes/random_model.h"

namespace color3d {
namespace {

TEST(GaussianFileTest, RoundTripsBitForBit) {
  for (const auto& m :
       {RandomModel({13, 1, 2, 0}), RandomModel({7, 3, 3, 1}), RandomModel({0, 1, 0, 0})}) {
    const GaussianModel back = ParseGaussians(SerializeGaussians(m));
    EXPECT_EQ(back.channels, m.channels);
    EXPECT_EQ(back.position, m.position);
    EXPECT_EQ(back.log_scale, m.log_scale);
    EXPECT_EQ(back.rotation, m.rotation);
    EXPECT_EQ(back.opacity_logit, m.opacity_logit);
    EXPECT_EQ(back.sh_l, m.sh_l);
    EXPECT_EQ(back.sh_a, m.sh_a);
    EXPECT_EQ(back.sh_b, m.sh_b);
  }
}

TEST(GaussianFileTest, KeepsConfidenceIfPresent) {
  GaussianModel m = RandomModel({5, 3, 1, 0});
  const std::string plain = SerializeGaussians(m);
  EXPECT_EQ(plain[8], 1) << "version 1, which older programs read";
  EXPECT_TRUE(ParseGaussians(plain).confidence.empty());
  m.confidence = {0.0f, 0.25f, 0.5f, 0.75f, 1.0f};
  const std::string bytes = SerializeGaussians(m);
  EXPECT_EQ(bytes[8], 2);
  EXPECT_EQ(bytes.size(), plain.size() + 5 * sizeof(float));
  const GaussianModel back = ParseGaussians(bytes);
  EXPECT_EQ(back.confidence, m.confidence);
  EXPECT_EQ(back.sh_b, m.sh_b);
  m.confidence[3] = 1.5f;
  EXPECT_THROW(SerializeGaussians(m), Error);
  m.confidence = {1.0f};
  EXPECT_THROW(SerializeGaussians(m), Error);
}

TEST(GaussianFileTest, KeepsChromaOfDegree3AndColorSpace) {
  GaussianModel m = RandomModel({5, 3, 3, 3});
  EXPECT_EQ(SerializeGaussians(m)[8], 1) << "Lab, which older programs read";
  m.color_space = ColorSpace::kSrgb;
  m.confidence = {0.0f, 0.25f, 0.5f, 0.75f, 1.0f};
  const std::string bytes = SerializeGaussians(m);
  EXPECT_EQ(bytes[8], 4) << "older programs refuse it";
  const GaussianModel back = ParseGaussians(bytes);
  EXPECT_EQ(back.color_space, ColorSpace::kSrgb);
  EXPECT_EQ(back.chroma_sh_degree, 3);
  EXPECT_EQ(back.sh_a, m.sh_a);
  EXPECT_EQ(back.sh_b, m.sh_b);
  EXPECT_EQ(back.confidence, m.confidence);
  EXPECT_EQ(back.motion.size(), 0u);
  EXPECT_EQ(SerializeGaussians(back), bytes);
}

std::string Signed(std::string content);

// Byte by byte what version 1 wrote.
TEST(GaussianFileTest, OpensFileOfVersion1) {
  std::string content = "C3DGAUSS";
  for (const uint32_t value : {1u, 3u, 0u, 0u, 1u, 0u}) {  // version, channels, degrees, count
    content.append(reinterpret_cast<const char*>(&value), 4);
  }
  for (int i = 0; i < 14; ++i) {
    const float value = 0.25f * static_cast<float>(i);
    content.append(reinterpret_cast<const char*>(&value), 4);
  }
  const GaussianModel m = ParseGaussians(Signed(content));
  EXPECT_EQ(m.color_space, ColorSpace::kLab);
  EXPECT_EQ(m.position, (std::vector<float>{0.0f, 0.25f, 0.5f}));
  EXPECT_EQ(m.sh_l, std::vector<float>{2.75f});
  EXPECT_EQ(m.sh_b, std::vector<float>{3.25f});
}

TEST(GaussianFileTest, KeepsDeformationField) {
  GaussianModel m = RandomModel({9, 3, 2, 1});
  const std::string plain = SerializeGaussians(m);
  m.hexplane = RandomHexPlanes();
  for (const bool confident : {false, true}) {
    if (confident) m.confidence.assign(9, 0.5f);
    const std::string bytes = SerializeGaussians(m);
    EXPECT_EQ(bytes[8], 5) << "programs without fields refuse it by its version";
    EXPECT_GT(bytes.size(), plain.size());
    const GaussianModel back = ParseGaussians(bytes);
    EXPECT_EQ(back.hexplane.shape, m.hexplane.shape);
    EXPECT_EQ(back.hexplane.planes, m.hexplane.planes);
    EXPECT_EQ(back.hexplane.network, m.hexplane.network);
    EXPECT_EQ(back.position, m.position);
    EXPECT_EQ(back.sh_b, m.sh_b);
    EXPECT_EQ(back.confidence, m.confidence);
    EXPECT_EQ(SerializeGaussians(back), bytes);
  }
  m.color_space = ColorSpace::kSrgb;
  EXPECT_EQ(ParseGaussians(SerializeGaussians(m)).color_space, ColorSpace::kSrgb);
  m.hexplane = {};
  EXPECT_TRUE(ParseGaussians(plain).hexplane.empty());
}

void ExpectRefused(const std::string& bytes, const std::string& why) {
  try {
    ParseGaussians(bytes);
    FAIL() << "accepted: " << why;
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(e.what(), testing::HasSubstr(why));
  }
}

std::string Signed(std::string content) { return content + Sha256Hex(content); }

TEST(GaussianFileTest, RejectsDamagedDeformationField) {
  GaussianModel m = RandomModel({9, 1, 0, 0});
  m.hexplane = RandomHexPlanes();
  const std::string good = SerializeGaussians(m);
  const std::string content = good.substr(0, good.size() - 64);
  for (size_t n = 0; n < good.size(); n += 401) {
    EXPECT_THROW(ParseGaussians(std::string_view(good).substr(0, n)), Error);
  }
  const auto with = [&](size_t at, uint32_t value) {
    std::string bytes = content;
    std::memcpy(bytes.data() + at, &value, sizeof(value));
    return Signed(bytes);
  };
  constexpr size_t kFeatures = 32 + 44, kLevels = kFeatures + 8, kSpace = kLevels + 4;
  ExpectRefused(with(kFeatures, 17), "features must be a multiple of 16");
  ExpectRefused(with(kFeatures, 32), "claims");
  ExpectRefused(with(kLevels, 9), "too many levels");
  ExpectRefused(with(kSpace, 1), "2 to 1024 samples");
  ExpectRefused(with(kSpace, 0x7fffffff), "2 to 1024 samples");
  std::string bytes = content;
  const float nan = std::nanf("");
  std::memcpy(bytes.data() + bytes.size() - 4, &nan, 4);
  ExpectRefused(Signed(bytes), "deformation network number");
  m.hexplane.planes.pop_back();
  EXPECT_THROW(SerializeGaussians(m), Error);
  m.hexplane = RandomHexPlanes();
  m.hexplane.shape.high[1] = m.hexplane.shape.low[1];
  EXPECT_THROW(SerializeGaussians(m), Error);
}

TEST(GaussianFileTest, RejectsHostileBytes) {
  const std::string good = SerializeGaussians(RandomModel({13, 3, 1, 0}));
  const std::string content = good.substr(0, good.size() - 64);
  ExpectRefused("", "only 0 bytes");
  for (size_t n = 0; n < good.size(); n += 11) {
    EXPECT_THROW(ParseGaussians(std::string_view(good).substr(0, n)), Error);
  }
  std::string bytes = good;
  bytes[0] = 'X';
  ExpectRefused(bytes, "C3DGAUSS");
  bytes = good;
  bytes[8] = 99;
  ExpectRefused(bytes, "version 99");
  bytes = good;
  bytes[100] ^= 1;
  ExpectRefused(bytes, "checksum");
  bytes = content;
  bytes[8] = 4;  // without the header of version 4
  EXPECT_THROW(ParseGaussians(Signed(bytes)), Error);
  bytes = content;
  bytes[8] = 2;  // without the confidence that version 2 has
  ExpectRefused(Signed(bytes), "claims");
  bytes = content;
  const uint64_t huge = ~uint64_t{0} / 8;
  std::memcpy(bytes.data() + 24, &huge, 8);
  ExpectRefused(Signed(bytes), "claims");
  bytes = content;
  const float nan = std::nanf("");
  std::memcpy(bytes.data() + 40, &nan, 4);
  ExpectRefused(Signed(bytes), "position of Gaussian 0 is not finite");
  bytes = content;
  std::memcpy(bytes.data() + 32 + 4 * (13 * 6 + 4 * 5 + 1), &nan, 4);
  ExpectRefused(Signed(bytes), "rotation of Gaussian 5 is not finite");
}

}  // namespace
}  // namespace color3d
