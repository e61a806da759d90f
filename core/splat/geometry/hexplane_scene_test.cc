// A bright ball that moves along a curve before a dark wall, reconstructed with a deformation by
// feature planes.
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"
#include "core/splat/geometry/geometry_trainer.h"
#include "core/splat/motion/geometry_in_time.h"

namespace color3d {
namespace {

constexpr int kSide = 48;  // px
constexpr int kTimes = 9;
constexpr int kHeldOutTime = 5;
constexpr double kWall = 5.5, kRadius = 0.5;

Eigen::Vector3d BallAt(double time_s) {
  const double angle = 0.25 * M_PI * time_s;  // a half circle in 4 s
  return {0.9 * std::cos(angle), 0.7 * std::sin(angle) - 0.35, 4.0 + 0.3 * std::cos(angle)};
}

PosedCamera CameraAt(double x, int view, double time_s) {
  PosedCamera posed;
  posed.view = view;
  posed.camera = {kSide, kSide, 45.0, 45.0, 24.0, 24.0};
  posed.cam_from_world.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(std::atan2(x, 4.0), Eigen::Vector3d::UnitY()));
  posed.cam_from_world.translation =
      -(posed.cam_from_world.rotation * Eigen::Vector3d(x, 0.0, 0.0));
  posed.time_s = time_s;
  return posed;
}

// L in 0..100.
Image Photo(const PosedCamera& posed) {
  Image image(kSide, kSide, 1);
  const Eigen::Vector3d origin = posed.cam_from_world.Center();
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      const Eigen::Vector3d ray =
          posed.cam_from_world.rotation.conjugate() * posed.camera.Ray(u + 0.5, v + 0.5);
      const Eigen::Vector3d wall = origin + (kWall - origin.z()) / ray.z() * ray;
      const Eigen::Vector3d to_ball = BallAt(posed.time_s) - origin;
      const double miss = (to_ball - to_ball.dot(ray) / ray.squaredNorm() * ray).norm();
      image.At(0, v, u) = static_cast<float>(
          miss < kRadius ? 90.0 : 25.0 + 6.0 * std::sin(3.0 * wall.x()) * std::cos(3.0 * wall.y()));
    }
  }
  return image;
}

GaussianModel FirstGaussians() {
  GaussianModel model;
  Random random(2);
  for (int i = 0; i < 500; ++i) {
    const bool wall = i % 2 == 0;
    const double x = random.NextUniform(-2.8, 2.8) * (wall ? 1.0 : 0.6);
    const double y = random.NextUniform(-2.8, 2.8) * (wall ? 1.0 : 0.4);
    const double z = wall ? kWall : random.NextUniform(3.6, 4.4);
    for (const double p : {x, y, z}) model.position.push_back(static_cast<float>(p));
    model.log_scale.insert(model.log_scale.end(), 3, std::log(wall ? 0.25f : 0.1f));
    model.rotation.insert(model.rotation.end(), {1.0f, 0.0f, 0.0f, 0.0f});
    model.opacity_logit.push_back(wall ? 1.0f : -2.0f);
    model.sh_l.push_back(0.0f);
  }
  return model;
}

GeometryProblem MovingBall() {
  GeometryProblem problem;
  std::vector<PosedCamera> views;
  for (int t = 0; t < kTimes; ++t) {
    for (const double x : {-1.2, 0.0, 1.2}) {
      views.push_back(CameraAt(x, static_cast<int>(views.size()), 0.5 * t));
      (t == kHeldOutTime ? problem.held_out : problem.training).push_back(views.back());
    }
  }
  problem.luminance = [views](int view) {
    return std::make_shared<const Image>(Photo(views[static_cast<size_t>(view)]));
  };
  problem.initial = FirstGaussians();
  problem.extent = 2.0;
  return problem;
}

GeometryOptions HexPlaneOptions() {
  GeometryOptions options;
  options.iterations = 500;
  options.max_gaussians = 700;
  options.sh_degree = 0;
  options.deformation = GeometryOptions::Deformation::kHexPlane;
  options.tuning.emplace();
  options.tuning->hexplane.width = 16;
  options.tuning->hexplane.space_samples = 16;
  options.tuning->hexplane.levels = 1;
  options.tuning->hexplane.samples_of_step = 0.7;
  options.tuning->hexplane.plane_rate = 8e-3;
  options.tuning->hexplane.network_rate = 1.6e-3;
  return options;
}

// A static scene reaches about 20 dB: the ball is a blur, or is not there.
TEST(HexPlaneSceneTest, LearnsBallOnCurve) {
  const GeometryProblem problem = MovingBall();
  GeometryOptions options = HexPlaneOptions();
  options.iterations = 1500;
  ThreadPool pool(2);
  NoCheckpoints none;
  NullObserver silent;
  TrainingTrace trace;
  trace.score_training = true;
  const GaussianModel model =
      TrainGeometry(problem, options, {pool, none, silent, CancellationToken()}, &trace);
  EXPECT_TRUE(model.IsDynamic());
  EXPECT_EQ(model.MovingCount(), model.size());
  EXPECT_GT(trace.training.psnr_db, 25.0);
}

TEST(HexPlaneSceneTest, ResumesBitForBitWithinDeformation) {
  struct Store : CheckpointStore {
    std::optional<std::string> Load() override { return saved; }
    bool WantsSave() override { return ++calls == 40; }
    void Save(const std::string& state) override { saved = state; }
    std::optional<std::string> saved;
    int calls = 0;
  };
  const GeometryProblem problem = MovingBall();
  GeometryOptions options = HexPlaneOptions();
  options.iterations = 60;
  ThreadPool pool(2);
  NullObserver silent;
  Store store;
  const std::string whole = SerializeGaussians(
      TrainGeometry(problem, options, {pool, store, silent, CancellationToken()}));
  ASSERT_TRUE(store.saved);
  store.calls = 1000;
  EXPECT_EQ(SerializeGaussians(
                TrainGeometry(problem, options, {pool, store, silent, CancellationToken()})),
            whole);
}

TEST(HexPlaneSceneTest, ModelOutsideItsTimesIsThatOfTheEnds) {
  GeometryOptions options = HexPlaneOptions();
  options.iterations = 60;
  ThreadPool pool(2);
  NoCheckpoints none;
  NullObserver silent;
  const GaussianModel model =
      TrainGeometry(MovingBall(), options, {pool, none, silent, CancellationToken()});
  EXPECT_EQ(ModelAt(model, -7.0, pool).position, ModelAt(model, model.begin_s(), pool).position);
  EXPECT_EQ(ModelAt(model, 70.0, pool).position, ModelAt(model, model.end_s(), pool).position);
  EXPECT_NE(ModelAt(model, 70.0, pool).position, ModelAt(model, 0.0, pool).position);
}

}  // namespace
}  // namespace color3d
