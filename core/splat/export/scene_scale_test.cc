// Training is invariant to the scale and origin of the scene; exports are in its frame.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/scene/import/normalise.h"
#include "core/splat/export/export.h"
#include "core/splat/geometry/geometry_trainer.h"
#include "tests/support/scenes/splat_scene.h"

namespace color3d {
namespace {

using testing_scene::MakeRoomCorner;
using testing_scene::ProceduralScene;

constexpr int kHeldOut = 3;

// x -> scale x + offset, cameras and points alike.
void Move(double scale, const Eigen::Vector3d& offset, Scene* scene) {
  for (View& view : scene->views) {
    Pose& pose = view.cam_from_world;
    pose.translation = scale * pose.translation - pose.rotation * offset;
  }
  for (SparsePoint& point : scene->points) point.position = scale * point.position + offset;
}

class LastHeldOut : public NullObserver {
 public:
  void OnError(int64_t, const std::string& name, double value) override {
    if (name == "heldout_psnr_l_db") psnr_db = value;
  }
  void OnWarning(const std::string& message) override { ADD_FAILURE() << message; }
  double psnr_db = 0.0;
};

struct Trained {
  double psnr_db = 0.0;
  GaussianModel model;
};

Trained TrainOnce(const ProceduralScene& s, uint64_t seed) {
  GeometryProblem problem;
  for (int i = 0; i < static_cast<int>(s.scene.views.size()); ++i) {
    const PosedCamera posed{i, s.scene.views[i].camera, s.scene.views[i].cam_from_world};
    (i == kHeldOut ? problem.held_out : problem.training).push_back(posed);
  }
  problem.luminance = [&s](int view) { return s.Luminance(view); };
  problem.initial = InitialGaussians(s.scene);
  problem.extent = s.scene.Extent();
  GeometryOptions options;
  options.iterations = 200;
  options.max_gaussians = 3000;
  options.sh_degree = 1;
  options.seed = seed;
  ThreadPool pool(2);
  NoCheckpoints none;
  LastHeldOut observer;
  Trained trained;
  trained.model = TrainGeometry(problem, options, {pool, none, observer, CancellationToken()});
  trained.psnr_db = observer.psnr_db;
  return trained;
}

// Short training is chaotic (0.3 dB from the last bit of a position): the mean of a few.
Trained Train(const ProceduralScene& s) {
  constexpr int kSeeds = 4;
  Trained mean;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    Trained trained = TrainOnce(s, seed);
    mean.psnr_db += trained.psnr_db / kSeeds;
    mean.model = std::move(trained.model);
  }
  return mean;
}

// Median of positions, and of the size of Gaussians, in a PLY file of degree 1.
struct FileStatistics {
  Eigen::Vector3d position;
  double scale = 0.0;
};

FileStatistics Read(const std::string& ply) {
  constexpr size_t kRowFloats = 17 + 9;
  const size_t begin = ply.find("end_header\n") + 11;
  const size_t count = (ply.size() - begin) / (kRowFloats * sizeof(float));
  std::vector<float> rows(count * kRowFloats);
  std::memcpy(rows.data(), ply.data() + begin, rows.size() * sizeof(float));
  const auto median = [&](size_t column) {
    std::vector<float> values;
    for (size_t i = 0; i < count; ++i) values.push_back(rows[i * kRowFloats + column]);
    std::nth_element(values.begin(), values.begin() + count / 2, values.end());
    return static_cast<double>(values[count / 2]);
  };
  return {{median(0), median(1), median(2)}, std::exp(median(19))};
}

FileStatistics Exported(const Trained& trained, const Scene& scene) {
  ThreadPool pool(1);
  return Read(EncodeGaussianPly(
      trained.model, FitRgbHarmonics(trained.model, pool), ExportFrameOf(scene), pool));
}

TEST(SceneScaleTest, TrainingIsInvariantToScaleAndOrigin) {
  const ProceduralScene original = MakeRoomCorner(7, 96, 72, 800);
  const Trained reference = Train(original);
  const FileStatistics expected = Exported(reference, original.scene);
  struct Case {
    double scale;
    Eigen::Vector3d offset;
    bool representable;
  };
  const Case cases[] = {
      {1e-6, {0, 0, 0}, true}, {1e6, {1e6, -1e6, 0}, true}, {1.0, {1e6, 0, 2e6}, false}};
  for (const Case& c : cases) {
    ProceduralScene moved = original;
    Move(c.scale, c.offset, &moved.scene);
    NormaliseScene(&moved.scene);
    const Trained trained = Train(moved);
    std::printf("scale %g offset %g: %.2f dB (original %.2f)\n",
                c.scale,
                c.offset.norm(),
                trained.psnr_db,
                reference.psnr_db);
    EXPECT_NEAR(trained.psnr_db, reference.psnr_db, 0.3);
    const ExportFrame frame = ExportFrameOf(moved.scene);
    EXPECT_EQ(frame.left_out.isZero(0.0), c.representable);
    const FileStatistics got = Exported(trained, moved.scene);
    const Eigen::Vector3d position = (got.position + frame.left_out - c.offset) / c.scale;
    EXPECT_LT((position - expected.position).norm(), 0.1) << position.transpose();
    EXPECT_NEAR(got.scale / c.scale / expected.scale, 1.0, 0.2);
  }
}

}  // namespace
}  // namespace color3d
