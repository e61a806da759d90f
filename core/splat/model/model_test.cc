#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/random.h"
#include "core/color/lab.h"
#include "core/splat/model/neighbors.h"
#include "core/splat/raster/render.h"
#include "tests/support/random_model.h"

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

TEST(GaussianFileTest, ConfidenceIsKeptAndFilesWithoutItStayAsTheyWere) {
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

TEST(GaussianFileTest, HostileBytesAreRefused) {
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

TEST(InitialGaussiansTest, ScaleIsTheMeanDistanceToTheNeighbours) {
  Scene scene;
  EXPECT_THROW(InitialGaussians(scene), Error);
  for (const double x : {0.0, 1.0, 2.0, 3.0}) {
    SparsePoint p;
    p.position = {x, 0.0, 0.0};
    scene.points.push_back(p);
  }
  const GaussianModel m = InitialGaussians(scene);
  ASSERT_EQ(m.size(), 4u);
  EXPECT_NEAR(std::exp(m.log_scale[0]), std::sqrt((1.0 + 4.0 + 9.0) / 3.0), 1e-5);
  EXPECT_NEAR(std::exp(m.log_scale[3]), std::sqrt((1.0 + 1.0 + 4.0) / 3.0), 1e-5);
  EXPECT_NEAR(1.0 / (1.0 + std::exp(-m.opacity_logit[2])), 0.1, 1e-6);
  EXPECT_EQ(m.sh_l[1], 0.0f);
}

TEST(InitialGaussiansTest, EqualPointsAndALonePointHaveASize) {
  Scene scene;
  scene.points.resize(1);
  EXPECT_TRUE(std::isfinite(InitialGaussians(scene).log_scale[0]));
  scene.points.resize(50);
  for (const float s : InitialGaussians(scene).log_scale) EXPECT_TRUE(std::isfinite(s));
}

TEST(NeighborTreeTest, AgreesWithSearchingAll) {
  Random random(6);
  std::vector<NeighborTree::Point> points(500);
  for (auto& p : points) {
    for (float& v : p) v = static_cast<float>(random.NextNormal());
  }
  points[7] = points[8];  // duplicates
  const NeighborTree tree(points);
  std::vector<NeighborTree::Neighbor> near;
  for (int q = 0; q < 50; ++q) {
    const NeighborTree::Point query = points[q];
    tree.Find(query, 4, near);
    std::vector<float> all;
    for (const auto& p : points) {
      float d = 0.0f;
      for (int k = 0; k < 3; ++k) d += (p[k] - query[k]) * (p[k] - query[k]);
      all.push_back(d);
    }
    std::sort(all.begin(), all.end());
    ASSERT_EQ(near.size(), 4u);
    for (int k = 0; k < 4; ++k) EXPECT_EQ(near[k].squared_distance, all[k]);
  }
}

TEST(RenderViewTest, GivesLabUnitsDepthAndOpacity) {
  ThreadPool pool(2);
  GaussianModel m;
  m.channels = 3;
  m.position = {0.0f, 0.0f, 2.0f};
  m.log_scale = {-1.0f, -1.0f, -1.0f};
  m.rotation = {1.0f, 0.0f, 0.0f, 0.0f};
  m.opacity_logit = {3.0f};
  m.sh_l = {0.0f};
  m.sh_a = {0.5f};
  m.sh_b = {0.0f};
  const Camera camera{41, 31, 40.0, 40.0, 20.5, 15.5};
  const RenderedView view = RenderView(m, camera, Pose(), pool, 0.5f);
  const float alpha = 1.0f / (1.0f + std::exp(-3.0f));
  EXPECT_NEAR(view.opacity.At(0, 15, 20), alpha, 1e-4);
  EXPECT_NEAR(view.depth.At(0, 15, 20), 2.0f, 1e-4);
  EXPECT_NEAR(view.lab.At(0, 15, 20), 50.0f, 1e-3);
  EXPECT_NEAR(view.lab.At(1, 15, 20), alpha * 255.0f * 0.28209479f * 0.5f, 1e-2);
  EXPECT_NEAR(view.lab.At(2, 15, 20), 0.0f, 1e-3);
  const RenderedView empty =
      RenderView(m, camera, Pose{Eigen::Quaterniond::Identity(), {0, 0, -9}}, pool, 0.25f);
  EXPECT_NEAR(empty.lab.At(0, 0, 0), 25.0f, 1e-4);
  EXPECT_NEAR(empty.lab.At(1, 0, 0), 0.0f, 1e-4);
  EXPECT_EQ(empty.depth.At(0, 0, 0), 0.0f);
  m.sh_b.clear();
  EXPECT_THROW(RenderView(m, camera, Pose(), pool), Error);
}

}  // namespace
}  // namespace color3d
