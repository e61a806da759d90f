#include "core/splat/export/motion/motion_file.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/splat/export/motion/playable_scene.h"
#include "core/splat/export/sog/sog.h"
#include "core/splat/motion/geometry_in_time.h"
#include "core/splat/raster/render.h"
#include "tests/support/scenes/random_model.h"

namespace color3d {
namespace {

MovingGaussians SomeMovers(size_t count) {
  Random random(4);
  MovingGaussians m;
  m.begin_s = 0.5;
  m.end_s = 4.5;
  m.total = static_cast<uint32_t>(3 * count + 2);
  const auto number = [&](double size) { return static_cast<float>(size * random.NextNormal()); };
  for (size_t i = 0; i < count; ++i) {
    m.index.push_back(static_cast<uint32_t>(3 * i + 1));
    m.center.push_back(number(0.6));
    m.log_width.push_back(-2.0f + number(0.8));
    for (int k = 0; k < 3; ++k) m.velocity.push_back(number(1.5));
    for (int k = 0; k < 3; ++k) m.acceleration.push_back(number(4.0));
    for (int k = 0; k < 4; ++k) m.spin.push_back(number(0.7));
  }
  return m;
}

float Widest(const std::vector<float>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low;
}

// |got - wanted| of numbers that are relative to their Gaussian's reach, against the bound of
// FORMAT.md.
void ExpectWithinBound(const std::vector<float>& got,
                       const std::vector<float>& wanted,
                       size_t width,
                       double power,
                       double steps,
                       const MovingGaussians& decoded) {
  const auto scaled = [&](const std::vector<float>& values, size_t i) {
    const double reach = MotionReach(decoded.center[i / width], decoded.log_width[i / width]);
    return values[i] * std::pow(reach, power);
  };
  double most = 0.0;
  for (size_t i = 0; i < wanted.size(); ++i) most = std::max(most, std::abs(scaled(wanted, i)));
  for (size_t i = 0; i < wanted.size(); ++i) {
    const double x = scaled(wanted, i);
    const double bound = std::sqrt(most * std::abs(x)) / steps + most / (4.0 * steps * steps);
    EXPECT_LE(std::abs(scaled(got, i) - x), 1.001 * bound + 1e-6 * most) << i;
  }
}

TEST(MotionFileTest, RoundTripsWithinErrorBounds) {
  const MovingGaussians m = SomeMovers(500);
  const std::string bytes = EncodeMotion(m);
  EXPECT_EQ(bytes.size(), 72 + (m.total + 7) / 8 + 20 * m.size());
  const MovingGaussians got = DecodeMotion(bytes);
  EXPECT_EQ(got.begin_s, m.begin_s);
  EXPECT_EQ(got.end_s, m.end_s);
  EXPECT_EQ(got.total, m.total);
  EXPECT_EQ(got.index, m.index);
  for (size_t i = 0; i < m.size(); ++i) {
    EXPECT_NEAR(got.center[i], m.center[i], Widest(m.center) / 131070 + 1e-6);
    EXPECT_NEAR(got.log_width[i], m.log_width[i], Widest(m.log_width) / 131068 + 1e-6);
  }
  ExpectWithinBound(got.velocity, m.velocity, 3, 1.0, 32767.0, got);
  ExpectWithinBound(got.acceleration, m.acceleration, 3, 2.0, 32767.0, got);
  ExpectWithinBound(got.spin, m.spin, 4, 1.0, 127.0, got);
}

TEST(MotionFileTest, RoundTripsEmptyAndConstantMotion) {
  const MovingGaussians none = DecodeMotion(EncodeMotion(MovingGaussians{.total = 9}));
  EXPECT_EQ(none.total, 9u);
  EXPECT_EQ(none.size(), 0u);
  MovingGaussians still = SomeMovers(1);
  still.velocity.assign(3, 0.0f);
  still.acceleration.assign(3, 0.0f);
  still.spin.assign(4, 0.0f);
  const MovingGaussians got = DecodeMotion(EncodeMotion(still));
  EXPECT_EQ(got.velocity, still.velocity);
  EXPECT_EQ(got.center, still.center);
  EXPECT_EQ(got.log_width, still.log_width);
}

TEST(MotionFileTest, WriterRefusesBadMotion) {
  const auto expect_refused = [](const MovingGaussians& m, const char* reason) {
    try {
      EncodeMotion(m);
      ADD_FAILURE() << reason;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
      EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
    }
  };
  MovingGaussians m = SomeMovers(3);
  m.velocity[4] = std::numeric_limits<float>::quiet_NaN();
  expect_refused(m, "velocity of moving Gaussian 1");
  m = SomeMovers(3);
  m.spin.pop_back();
  expect_refused(m, "spin");
  m = SomeMovers(3);
  std::swap(m.index[0], m.index[1]);
  expect_refused(m, "ascend");
  m = SomeMovers(3);
  m.total = m.index[2];
  expect_refused(m, "place");
  m = SomeMovers(3);
  m.end_s = m.begin_s - 1.0;
  expect_refused(m, "end after it begins");
  m = SomeMovers(3);
  m.acceleration[0] = std::numeric_limits<float>::max();
  m.log_width[0] = m.center[0] = 3.0f;
  expect_refused(m, "farther");
}

TEST(MotionFileTest, ReaderRefusesOtherBytes) {
  const std::string good = EncodeMotion(SomeMovers(20));
  const auto refused = [](const std::string& bytes) {
    try {
      DecodeMotion(bytes);
      return false;
    } catch (const Error& error) {
      return error.code() == ErrorCode::kInvalidArgument;
    }
  };
  for (const size_t size : {size_t{0}, size_t{40}, size_t{72}, good.size() - 1}) {
    EXPECT_TRUE(refused(good.substr(0, size))) << size;
  }
  EXPECT_TRUE(refused(good + "x"));
  // Magic, version, counts, reserved bytes, and floats that become NaN.
  for (const size_t at : {0u, 8u, 12u, 16u, 20u, 68u}) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x55);
    EXPECT_TRUE(refused(bad)) << at;
  }
  for (const size_t at : {24u, 32u, 40u, 48u, 56u, 60u, 64u}) {
    std::string bad = good;
    bad.replace(at, at < 40 ? 8 : 4, at < 40 ? 8 : 4, '\xff');
    EXPECT_TRUE(refused(bad)) << at;
  }
  std::string unmarked = good;
  unmarked[72] = '\0';
  EXPECT_TRUE(refused(unmarked));
}

// The last Gaussians move over 2 s, turn, appear and vanish.
GaussianModel MovingModel() {
  constexpr size_t kMovers = 25;
  GaussianModel model = RandomModel({60, 3, 1, 0, /*chroma_size=*/0.03});
  for (size_t i = 0; i < model.size(); ++i) {
    model.confidence.push_back(static_cast<float>(i) / 60.0f);
  }
  Random random(5);
  const auto fill = [&](std::vector<float>& row, size_t width, double mean, double size) {
    for (size_t i = 0; i < kMovers * width; ++i) {
      row.push_back(static_cast<float>(mean + size * random.NextNormal()));
    }
  };
  model.motion.begin_s = 1.0;
  model.motion.end_s = 3.0;
  fill(model.motion.velocity, 3, 0.0, 0.5);
  fill(model.motion.acceleration, 3, 0.0, 0.2);
  fill(model.motion.spin, 4, 0.0, 0.8);
  fill(model.motion.center, 1, 0.0, 0.5);
  fill(model.motion.log_width, 1, -1.0, 0.3);
  return model;
}

TEST(PlayableSceneTest, MovesAsTheModelDoes) {
  ThreadPool pool(2);
  const GaussianModel model = MovingModel();
  ASSERT_TRUE(IsPlayable(model));
  EXPECT_FALSE(IsPlayable(ModelAt(model, 2.0, pool)));
  const ExportFrame frame{2.0, {1.0, -2.0, 3.0}};
  const PlayableScene scene = EncodePlayable(model, FitRgbHarmonics(model, pool), frame, pool);
  const MovingGaussians m = DecodeMotion(scene.motion);
  ASSERT_EQ(m.size(), model.motion.size());
  ASSERT_EQ(m.total, model.size());
  const ViewerGaussians base = ForViewers(model, FitRgbHarmonics(model, pool), frame, pool);
  const std::vector<uint32_t> order = SogOrder(base.position);
  for (size_t i = 0; i < order.size(); ++i) {
    EXPECT_EQ(scene.confidence[i], model.confidence[order[i]]);
  }
  for (const double time_s : {1.0, 1.7, 3.0}) {
    const ParameterBlock truth = ParametersAt(model, time_s, pool);
    const float t = model.motion.UnitTime(time_s);
    for (size_t j = 0; j < m.size(); ++j) {
      const size_t i = order[m.index[j]];
      const float tau = t - m.center[j], scaled = tau / std::exp(m.log_width[j]);
      const double weight = std::exp(-0.5 * scaled * scaled);
      const double opacity = weight / (1.0 + std::exp(-base.opacity_logit[i]));
      EXPECT_NEAR(opacity, 1.0 / (1.0 + std::exp(-truth.Row(kOpacityRow)[i])), 3e-4);
      if (std::abs(tau) > MotionReach(m.center[j], m.log_width[j])) continue;
      for (size_t k = 0; k < 3; ++k) {
        const double moved = base.position[3 * i + k] +
                             tau * (m.velocity[3 * j + k] + tau * m.acceleration[3 * j + k]);
        const double wanted =
            frame.scale * truth.Row(kPositionRow + static_cast<int>(k))[i] + frame.offset[k];
        EXPECT_NEAR(moved, wanted, 1e-3) << time_s << " " << i;
      }
      const auto quaternion = [](const float* q) {
        return Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
      };
      const float* s = m.spin.data() + 4 * j;
      const Eigen::Quaterniond turned =
          quaternion(base.rotation.data() + 4 * i) *
          Eigen::Quaterniond(1.0 + tau * s[0], tau * s[1], tau * s[2], tau * s[3]);
      Eigen::Quaterniond wanted(truth.Row(kRotationRow)[i],
                                truth.Row(kRotationRow + 1)[i],
                                truth.Row(kRotationRow + 2)[i],
                                truth.Row(kRotationRow + 3)[i]);
      EXPECT_LT(turned.normalized().angularDistance(wanted.normalized()), 0.15);
    }
  }
}

TEST(PlayableSceneTest, LeavesOutWhatNoTimeShows) {
  ThreadPool pool(2);
  GaussianModel model = MovingModel();
  const size_t first = model.size() - model.motion.size();
  model.opacity_logit[0] = -20.0f;
  model.motion.center[1] = 9.0f;  // long after the end
  const GaussianModel seen = EverSeen(model);
  EXPECT_LE(seen.size(), model.size() - 2);
  EXPECT_LE(seen.motion.size(), model.motion.size() - 1);
  EXPECT_EQ(std::count(seen.position.begin(), seen.position.end(), model.position[0]), 0);
  EXPECT_EQ(std::count(seen.position.begin(), seen.position.end(), model.position[3 * (first + 1)]),
            0);
  const Camera camera{64, 48, 60.0, 60.0, 32.0, 24.0};
  Pose pose;
  pose.translation = {0.0, 0.0, 6.0};
  for (const double time_s : {1.0, 2.0, 3.0}) {
    const Image all = RenderView(model, camera, pose, pool, 0.0f, time_s).lab;
    const Image kept = RenderView(seen, camera, pose, pool, 0.0f, time_s).lab;
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) EXPECT_NEAR(all.At(0, y, x), kept.At(0, y, x), 2.0f);
    }
  }
}

}  // namespace
}  // namespace color3d
