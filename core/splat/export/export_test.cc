#include "core/splat/export/export.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <sstream>

#include "core/base/error.h"
#include "core/splat/model/spherical_harmonics.h"
#include "tests/support/scenes/random_model.h"
#include "tests/support/scenes/splat_scene.h"

namespace color3d {
namespace {

GaussianModel DullModel(size_t count, int degree, int chroma_degree) {
  return RandomModel({count, 3, degree, chroma_degree, /*chroma_size=*/0.03});
}

TEST(ExportTest, PlyHasStandardLayout) {
  ThreadPool pool(2);
  GaussianModel m = DullModel(5, 1, 0);
  for (int k = 0; k < 4; ++k) m.rotation[k] = 0.0f;
  const RgbHarmonics rgb = FitRgbHarmonics(m, pool);
  const std::string bytes =
      EncodeGaussianPly(m, rgb, {2.0, {100.0, 200.0, 300.0}, {0.0, 0.0, 0.0}}, pool);
  const size_t end = bytes.find("end_header\n") + 11;
  std::istringstream header(bytes.substr(0, end));
  std::vector<std::string> names;
  std::string line;
  while (std::getline(header, line)) {
    if (line.rfind("property float ", 0) == 0) names.push_back(line.substr(15));
  }
  EXPECT_THAT(bytes, testing::StartsWith("ply\nformat binary_little_endian 1.0\n"));
  EXPECT_THAT(bytes, testing::HasSubstr("element vertex 5\n"));
  EXPECT_THAT(bytes.substr(0, end), testing::Not(testing::HasSubstr("comment")));
  ASSERT_EQ(names.size(), 17u + 9u);
  EXPECT_EQ(names[6], "f_dc_0");
  EXPECT_EQ(names[9], "f_rest_0");
  EXPECT_EQ(names[18], "opacity");
  EXPECT_EQ(names.back(), "rot_3");
  ASSERT_EQ(bytes.size(), end + 5 * names.size() * sizeof(float));
  std::vector<float> row(names.size());
  std::memcpy(row.data(), bytes.data() + end, row.size() * sizeof(float));
  EXPECT_NEAR(row[0], 2.0 * m.position[0] + 100.0, 1e-4);
  EXPECT_EQ(row[6], rgb.sh[0]);
  EXPECT_EQ(row[9], rgb.sh[3]);   // f_rest: channel by channel
  EXPECT_EQ(row[12], rgb.sh[4]);  // green begins
  EXPECT_EQ(row[18], m.opacity_logit[0]);
  EXPECT_NEAR(row[19], m.log_scale[0] + std::log(2.0), 1e-6);
  EXPECT_EQ(row[22], 1.0f);  // a zero quaternion becomes the identity
  EXPECT_EQ(row[23], 0.0f);
  EXPECT_THROW(
      EncodeGaussianPly(m, DegreeZero(FitRgbHarmonics(DullModel(4, 1, 0), pool)), {}, pool), Error);
}

TEST(ExportTest, ConfidenceIsLastPropertyIfRequested) {
  ThreadPool pool(2);
  GaussianModel m = DullModel(4, 1, 0);
  const RgbHarmonics rgb = FitRgbHarmonics(m, pool);
  m.confidence = {0.125f, 0.25f, 1.0f, 0.0f};
  const std::string plain = EncodeGaussianPly(m, rgb, {}, pool);
  EXPECT_THAT(plain, testing::Not(testing::HasSubstr("confidence")));
  const std::string bytes = EncodeGaussianPly(m, rgb, {}, pool, /*with_confidence=*/true);
  EXPECT_THAT(bytes, testing::HasSubstr("property float rot_3\nproperty float confidence\nend_"));
  const size_t row = 17 + 9 + 1;
  const size_t body = bytes.find("end_header\n") + 11;
  ASSERT_EQ(bytes.size(), body + 4 * row * sizeof(float));
  const size_t plain_body = plain.find("end_header\n") + 11;
  for (size_t i = 0; i < 4; ++i) {
    const char* begin = bytes.data() + body + i * row * sizeof(float);
    float confidence = 0.0f;
    std::memcpy(&confidence, begin + (row - 1) * sizeof(float), sizeof(float));
    EXPECT_EQ(confidence, m.confidence[i]);
    EXPECT_EQ(std::memcmp(begin,
                          plain.data() + plain_body + i * (row - 1) * sizeof(float),
                          (row - 1) * sizeof(float)),
              0);
  }
}

struct SplatRow {
  float position[3];
  float scale[3];
  uint8_t rgba[4];
  uint8_t rotation[4];
};
static_assert(sizeof(SplatRow) == 32);

TEST(ExportTest, SplatIsSortedByImportance) {
  ThreadPool pool(1);
  const GaussianModel m = DullModel(50, 1, 0);
  const RgbHarmonics rgb = FitRgbHarmonics(m, pool);
  const std::string bytes = EncodeSplat(m, rgb, {3.0, {10.0, 0.0, -5.0}, {0.0, 0.0, 0.0}}, pool);
  ASSERT_EQ(bytes.size(), 50u * 32);
  std::vector<SplatRow> rows(50);
  std::memcpy(rows.data(), bytes.data(), bytes.size());
  std::vector<char> seen(50, 0);
  double last = 1e30;
  for (const SplatRow& row : rows) {
    size_t found = 50;
    for (size_t i = 0; i < m.size(); ++i) {
      const float x = static_cast<float>(3.0 * m.position[3 * i] + 10.0);
      if (row.position[0] == x) found = i;
    }
    ASSERT_LT(found, 50u);
    seen[found] = 1;
    const double opacity = 1.0 / (1.0 + std::exp(-m.opacity_logit[found]));
    const double importance = row.scale[0] * row.scale[1] * row.scale[2] * opacity;
    EXPECT_LE(importance, last * 1.0001);
    last = importance;
    EXPECT_NEAR(row.scale[1], 3.0 * std::exp(m.log_scale[3 * found + 1]), 1e-3 * row.scale[1]);
    EXPECT_NEAR(row.rgba[3], 255.0 * opacity, 0.51);
    const double red = 255.0 * (0.5 + kShDc * rgb.sh[found * 12]);
    EXPECT_NEAR(row.rgba[0], std::clamp(red, 0.0, 255.0), 0.51);
    const float* q = m.rotation.data() + 4 * found;
    const float norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int k = 0; k < 4; ++k) {
      EXPECT_NEAR((row.rotation[k] - 128.0) / 128.0, q[k] / norm, 0.0079);
    }
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), 50);
}

TEST(ExportTest, LargeOffsetStaysInHeader) {
  ThreadPool pool(1);
  Scene scene = testing_scene::MakeRoomCorner(4, 32, 24, 10).scene;  // extent below 1
  scene.world_from_scene_scale = 0.5;
  scene.world_offset = {1000.0, -2.0, 0.1};  // rounded by 6e-5
  ExportFrame frame = ExportFrameOf(scene);
  EXPECT_EQ(frame.scale, 0.5);
  EXPECT_EQ(frame.offset, scene.world_offset);
  EXPECT_TRUE(frame.left_out.isZero(0.0));
  scene.world_offset = {1e6, -2.0, 0.1};
  frame = ExportFrameOf(scene);
  EXPECT_TRUE(frame.offset.isZero(0.0));
  EXPECT_EQ(frame.left_out, scene.world_offset);
  const GaussianModel m = DullModel(2, 0, 0);
  EXPECT_THAT(EncodeGaussianPly(m, FitRgbHarmonics(m, pool), frame, pool),
              testing::HasSubstr("1.0\ncomment offset 1e+06 -2 0.1\nelement"));
}

}  // namespace
}  // namespace color3d
