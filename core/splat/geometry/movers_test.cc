#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "core/splat/geometry/moving_part.h"
#include "core/splat/motion/motion.h"
#include "core/splat/movers/motion_survey.h"
#include "core/splat/movers/mover_seeds.h"

namespace color3d {
namespace {

constexpr int kSide = 96;  // px
constexpr double kWall = 6.0;
constexpr double kBallRadius = 0.6;

// Looks along +z from (x, 0, 0), turned so that (0, 0, 4) is in the middle.
PosedCamera CameraAt(double x, int shot, double time_s) {
  PosedCamera posed;
  posed.camera = {kSide, kSide, 90.0, 90.0, 48.0, 48.0};
  const double angle = std::atan2(-x, 4.0);
  posed.cam_from_world.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY()));
  posed.cam_from_world.translation =
      -(posed.cam_from_world.rotation * Eigen::Vector3d(x, 0.0, 0.0));
  posed.time_s = time_s;
  posed.shot = shot;
  return posed;
}

Eigen::Vector3d BallAt(double time_s) { return {0.4 * time_s - 0.8, 0.0, 4.0}; }

// A wall at z = kWall and a ball in front of it.
SurveyedView ViewAt(double x, int shot, double time_s, bool with_ball) {
  SurveyedView view;
  view.posed = CameraAt(x, shot, time_s);
  view.luminance = view.drawn = view.depth = Image(kSide, kSide, 1);
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      const Pose& pose = view.posed.cam_from_world;
      const Eigen::Vector3d origin = pose.Center();
      const Eigen::Vector3d ray =
          pose.rotation.conjugate() * view.posed.camera.Ray(u + 0.5, v + 0.5);
      const double to_wall = (kWall - origin.z()) / ray.z();
      const Eigen::Vector3d at = origin + to_wall * ray;
      const double wall = 0.5 + 0.1 * std::sin(3.0 * at.x()) * std::cos(2.0 * at.y());
      view.drawn.At(0, v, u) = view.luminance.At(0, v, u) = static_cast<float>(wall);
      view.depth.At(0, v, u) = static_cast<float>(to_wall);
      if (!with_ball) continue;
      const Eigen::Vector3d to_ball = BallAt(time_s) - origin;
      const double along = to_ball.dot(ray) / ray.squaredNorm();
      const double miss = (to_ball - along * ray).squaredNorm();
      if (miss > kBallRadius * kBallRadius) continue;
      view.luminance.At(0, v, u) =
          static_cast<float>(0.9 - 0.3 * std::sin(9.0 * (v / 96.0 + 0.3 * u / 96.0)));
    }
  }
  return view;
}

std::vector<SurveyedView> Rig(int times, bool with_ball) {
  std::vector<SurveyedView> views;
  for (int t = 0; t < times; ++t) {
    int shot = 0;
    for (const double x : {-1.5, 0.0, 1.5}) views.push_back(ViewAt(x, shot++, t, with_ball));
  }
  return views;
}

double Share(const Image& mask) {
  double sum = 0.0;
  for (const float v : mask.data) sum += v;
  return sum / static_cast<double>(mask.data.size());
}

TEST(MotionSurveyTest, FindsRegionsMissingFromRender) {
  ThreadPool pool(2);
  std::vector<SurveyedView> views = Rig(4, true);
  const MotionSurvey survey = SurveyMotion(pool, views);
  const double disc = M_PI * std::pow(90.0 * kBallRadius / 4.0, 2) / (kSide * kSide);
  EXPECT_NEAR(survey.moving_share, disc, 0.3 * disc);
  for (const SurveyedView& view : views) EXPECT_NEAR(Share(view.moving), disc, 0.6 * disc);
}

TEST(MotionSurveyTest, FindsNothingInWellDrawnOrSingleTime) {
  ThreadPool pool(2);
  std::vector<SurveyedView> still = Rig(4, false);
  EXPECT_EQ(SurveyMotion(pool, still).moving_share, 0.0);
  std::vector<SurveyedView> moment = Rig(1, true);
  EXPECT_EQ(SurveyMotion(pool, moment).moving_share, 0.0);
}

// For a static camera a constant residual is a badly drawn static region.
TEST(MotionSurveyTest, ConstantResidualIsNotMotion) {
  ThreadPool pool(2);
  std::vector<SurveyedView> views = Rig(7, false);
  for (SurveyedView& view : views) {
    for (int i = 0; i < 20 * kSide; ++i) view.drawn.data[i] += 0.3f;
  }
  EXPECT_EQ(SurveyMotion(pool, views).moving_share, 0.0);
}

// Rows first to end - 1 have known motion.
std::vector<SurveyedView> WithSeen(std::vector<SurveyedView> views, int first, int end) {
  for (SurveyedView& view : views) {
    view.still = Image(kSide, kSide, 1, 1.0f);
    std::fill_n(view.still.data.begin() + first * kSide, (end - first) * kSide, 0.0f);
  }
  return views;
}

TEST(MotionSurveyTest, KnownMotionIncludesWellDrawnPixels) {
  ThreadPool pool(2);
  std::vector<SurveyedView> without = Rig(4, true);
  std::vector<SurveyedView> views = WithSeen(without, 30, 48);  // with the ball's upper half
  const MotionSurvey alone = SurveyMotion(pool, without), both = SurveyMotion(pool, views);
  EXPECT_EQ(both.residual_share, alone.moving_share);
  EXPECT_NEAR(both.moving_share, 18.0 / kSide + 0.5 * alone.moving_share, 0.01);
  EXPECT_EQ(views[2].moving.At(0, 30, 0), 1.0f);
}

TEST(MotionSurveyTest, KnownMotionDrawnWellIsStatic) {
  ThreadPool pool(2);
  std::vector<SurveyedView> views = WithSeen(Rig(4, false), 0, 9);
  EXPECT_EQ(SurveyMotion(pool, views).moving_share, 0.0);
}

// A moving camera has no median over time: badly drawn regions look like motion.
TEST(MotionSurveyTest, MovingCameraNeedsMoreEvidence) {
  ThreadPool pool(2);
  std::vector<SurveyedView> moving;
  for (int t = 0; t < 6; ++t) moving.push_back(ViewAt(0.1 * t, 0, t, true));
  std::vector<SurveyedView> seen = WithSeen(moving, 30, 48), standing = Rig(6, true);
  const double alone = SurveyMotion(pool, moving).least_share;
  EXPECT_EQ(alone, 0.005);
  EXPECT_EQ(SurveyMotion(pool, seen).least_share, 0.002);
  EXPECT_EQ(SurveyMotion(pool, standing).least_share, 0.002);
}

struct Seeded {
  ParameterBlock block;
  int rows = kColorRow + 1;
};

Seeded SeedsOf(std::vector<SurveyedView>& views, int64_t most) {
  ThreadPool pool(2);
  SurveyMotion(pool, views);
  Seeded seeded;
  MoverSeedOptions options;
  options.rows = seeded.rows;
  options.most = most;
  options.interval = 0.5;
  std::vector<float> unit_time;
  for (const SurveyedView& view : views) {
    unit_time.push_back(static_cast<float>(0.5 * view.posed.time_s - 1.0));
  }
  seeded.block = SeedMovers(views, unit_time, options, pool);
  return seeded;
}

TEST(MoverSeedsTest, SeedsFollowBall) {
  std::vector<SurveyedView> views = Rig(5, true);
  const Seeded seeds = SeedsOf(views, 600);
  const ParameterBlock& b = seeds.block;
  ASSERT_GT(b.count(), 150);
  ASSERT_LE(b.count(), 700);
  int near = 0, along = 0;
  for (int64_t i = 0; i < b.count(); ++i) {
    const double time_s = 2.0 * (b.Row(seeds.rows + kCenterRow)[i] + 1.0);
    const Eigen::Vector3d at(b.Row(0)[i], b.Row(1)[i], b.Row(2)[i]);
    if ((at - BallAt(time_s)).norm() < 1.6 * kBallRadius) ++near;
    // 0.4 to the right each second; a unit of t is two seconds.
    if (std::abs(b.Row(seeds.rows + kVelocityRow)[i] - 0.8f) < 0.6f) ++along;
  }
  EXPECT_GT(near, 0.6 * static_cast<double>(b.count()));
  EXPECT_GT(along, 0.6 * static_cast<double>(b.count()));
}

TEST(MoverSeedsTest, OneCameraSeedsInFrontOfWall) {
  std::vector<SurveyedView> views;
  for (int t = 0; t < 5; ++t) views.push_back(ViewAt(0.0, 0, t, true));
  const Seeded seeds = SeedsOf(views, 200);
  ASSERT_GT(seeds.block.count(), 20);
  for (int64_t i = 0; i < seeds.block.count(); ++i) {
    EXPECT_LE(seeds.block.Row(2)[i], kWall + 1e-3);
    EXPECT_GT(seeds.block.Row(2)[i], 0.5);
    EXPECT_TRUE(std::isfinite(seeds.block.Row(kLogScaleRow)[i]));
  }
}

std::vector<PosedCamera> PosedRig(int cameras, int times) {
  std::vector<PosedCamera> views;
  for (int camera = 0; camera < cameras; ++camera) {
    for (int t = 0; t < times; ++t) views.push_back(CameraAt(0.1 * camera, camera, t));
  }
  return views;
}

TEST(BlocksOfTimeTest, BlocksAreBoundedAndKeepTimesWhole) {
  struct Case {
    int cameras, times;
    size_t blocks, largest;
  };
  for (const Case& c : {Case{1, 100, 1, 100},
                        Case{1, 400, 4, 100},
                        Case{4, 100, 4, 100},
                        Case{1, 12'800, 100, 128},
                        Case{20, 50, 2, 500},  // at least 24 times a block
                        Case{30, 12, 1, 360}}) {
    const auto blocks = BlocksOfTime(PosedRig(c.cameras, c.times));
    EXPECT_EQ(blocks.size(), c.blocks);
    size_t views = 0, largest = 0;
    double begin_s = 0.0;
    for (const std::vector<PosedCamera>& block : blocks) {
      views += block.size();
      largest = std::max(largest, block.size());
      double end_s = 0.0;
      for (const PosedCamera& view : block) {
        EXPECT_GE(view.time_s, begin_s);
        end_s = std::max(end_s, view.time_s);
      }
      begin_s = end_s + 1.0;
    }
    EXPECT_EQ(views, static_cast<size_t>(c.cameras * c.times));
    EXPECT_EQ(largest, c.largest);
  }
}

// A long film is surveyed in blocks of time; each has seeds.
TEST(FindMovingPartTest, LongFilmHasMoversAtAllTimes) {
  constexpr int kFrames = 300, kMost = 3000;
  GeometryProblem problem;
  for (int t = 0; t < kFrames; ++t) {
    problem.training.push_back(CameraAt(0.0, 0, 4.0 * t / (kFrames - 1)));
    problem.training.back().view = t;
  }
  ParameterBlock wall(kColorRow + 1, 1);  // one large Gaussian
  wall.Row(kPositionRow + 2)[0] = static_cast<float>(kWall);
  for (int k = 0; k < 3; ++k) wall.Row(kLogScaleRow + k)[0] = k == 2 ? -3.0f : 3.0f;
  wall.Row(kRotationRow)[0] = 1.0f;
  wall.Row(kOpacityRow)[0] = 5.0f;
  ColorSpec color;
  color.channel[0] = {kColorRow, 1, 0.5f, true};
  const LevelTarget target = [](const PosedCamera& posed, int) {
    return std::make_shared<const PlaneBuffer>(
        PlanesFromImage(ViewAt(0.0, 0, posed.time_s, true).luminance, 0.0f, 1.0f));
  };
  GeometryOptions options;
  options.sh_degree = 0;
  options.max_gaussians = kMost;
  ThreadPool pool(2);
  const MoverSearchResult found =
      FindMovingPart(problem, TimeSpanOf(problem), wall, color, target, options, pool);
  EXPECT_GT(found.moving_share, 0.02);
  const ParameterBlock& movers = found.moving.parameters;
  EXPECT_LE(movers.count(), kMost);
  EXPECT_GT(movers.count(), kMost / 20);
  std::set<int> tenths;
  for (int64_t i = 0; i < movers.count(); ++i) {
    const float t = movers.Row(wall.rows() + kCenterRow)[i];
    tenths.insert(std::min(9, static_cast<int>(5.0f * (t + 1.0f))));
  }
  EXPECT_EQ(tenths.size(), 10u);
}

TEST(MoverSeedsTest, NoMotionGivesNoSeeds) {
  std::vector<SurveyedView> views = Rig(4, false);
  EXPECT_EQ(SeedsOf(views, 100).block.count(), 0);
}

}  // namespace
}  // namespace color3d
