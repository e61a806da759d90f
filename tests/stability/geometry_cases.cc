// Training of luminance geometry on degenerate scenes: every parameter stays finite, or the scene
// is refused with a reason.
#include <cmath>
#include <limits>
#include <memory>

#include "core/base/files.h"
#include "core/scene/view_images.h"
#include "core/splat/geometry/geometry_trainer.h"
#include "tests/stability/tiny_problem.h"
#include "tests/support/scenes/procedural_scene.h"

namespace color3d {
namespace {

constexpr int kSide = 64;

struct Training {
  std::vector<PosedCamera> cameras;
  std::function<Image(int view)> picture;
  GaussianModel initial;
  GeometryOptions options;
  double extent = 1.0;
};

// Four views on a short arc of a cloud, 60 iterations.
Training Ordinary() {
  Training t;
  for (int i = 0; i < 4; ++i) t.cameras.push_back(OrbitCamera(i, kSide, kSide, 0.15 * i));
  t.picture = [](int view) { return Texture(kSide, kSide, view); };
  t.initial = CloudOf(200, 4);
  t.options.iterations = 60;
  t.options.max_gaussians = 400;
  t.options.sh_degree = 1;
  return t;
}

GaussianModel Train(const Training& t, ProgressObserver& observer, ThreadPool& pool) {
  GeometryProblem problem;
  problem.training = t.cameras;
  problem.extent = t.extent;
  problem.initial = t.initial;
  problem.luminance = [&t](int view) { return std::make_shared<Image>(t.picture(view)); };
  NoCheckpoints none;
  return TrainGeometry(problem, t.options, {pool, none, observer, CancellationToken()});
}

StabilityResult RunTraining(const Training& t, ThreadPool& pool) {
  TrainingWitness witness;
  const GaussianModel model = Train(t, witness, pool);
  StabilityResult result;
  result.condition_of = "-";
  result.non_finite = CountNonFinite(model) + witness.non_finite;
  result.compared = static_cast<int64_t>(model.size());
  result.held = model.size() > 0;
  char text[160];
  std::snprintf(text,
                sizeof(text),
                "%zu Gaussians, error %.3g -> %.3g, %lld restores, %zu warnings",
                model.size(),
                witness.first,
                witness.last,
                static_cast<long long>(witness.restores),
                witness.warnings.size());
  result.outcome = text;
  if (!witness.warnings.empty()) result.outcome += ", first: " + witness.warnings.front();
  result.restores = witness.restores;
  return result;
}

Training OfConstant(float luminance) {
  Training t = Ordinary();
  t.picture = [luminance](int) { return Image(kSide, kSide, 1, luminance); };
  return t;
}

Training OfViews(int count, double step_rad, bool look_away) {
  Training t = Ordinary();
  t.cameras.clear();
  for (int i = 0; i < count; ++i) {
    t.cameras.push_back(OrbitCamera(i, kSide, kSide, step_rad * i, look_away && i % 2 == 1));
  }
  return t;
}

Training OfPictureSize(int width, int height) {
  Training t = Ordinary();
  for (int i = 0; i < 4; ++i) t.cameras[i] = OrbitCamera(i, width, height, 0.15 * i);
  t.picture = [=](int view) { return Texture(width, height, view); };
  return t;
}

Training OfRate(double scale) {
  Training t = Ordinary();
  t.options.learning_rate_scale = scale;
  t.options.iterations = 250;
  return t;
}

// Needles, pancakes, extreme sizes and quaternions.
Training OfHardStart() {
  Training t = Ordinary();
  for (size_t i = 0; i < t.initial.size(); ++i) {
    const float extremes[] = {-18.0f, -9.0f, -2.5f, 4.0f, 13.8f};
    for (size_t k = 0; k < 3; ++k) t.initial.log_scale[3 * i + k] = extremes[(i + k * i / 5) % 5];
    if (i % 4 == 0) std::fill_n(&t.initial.rotation[4 * i], 4, 0.0f);
    t.initial.opacity_logit[i] = i % 3 == 0 ? 40.0f : i % 3 == 1 ? -40.0f : 0.0f;
  }
  return t;
}

Training OfDuplicates() {
  Training t = Ordinary();
  for (size_t i = 1; i < t.initial.size(); ++i) {
    std::copy_n(&t.initial.position[0], 3, &t.initial.position[3 * i]);
  }
  return t;
}

// A NaN pixel in one of the four photos.
Training OfSpoiltPhoto() {
  Training t = Ordinary();
  t.picture = [](int view) {
    Image l = Texture(kSide, kSide, view);
    if (view == 2) l.At(0, 10, 10) = std::numeric_limits<float>::quiet_NaN();
    return l;
  };
  return t;
}

// Read from files; all sparse points are mirrored behind their cameras.
StabilityResult PointsBehindCameras(ThreadPool& pool) {
  ProceduralSceneOptions options;
  options.views = 3;
  options.width = kSide;
  options.height = 48;
  options.supersampling = 1;
  options.sparse_points = 200;
  const ScratchFolder folder;
  WriteProceduralScene(folder.path(), options);
  Scene scene = ProceduralScene(options).scene();
  Eigen::Vector3d center = Eigen::Vector3d::Zero(), forward = Eigen::Vector3d::Zero();
  for (const View& view : scene.views) {
    center += view.cam_from_world.Center() / static_cast<double>(scene.views.size());
    forward += view.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  }
  for (SparsePoint& point : scene.points) {
    const double depth = std::abs((point.position - center).dot(forward.normalized()));
    point.position = center - (10.0 + depth) * forward.normalized();
  }
  const ViewImages images(scene, folder.path(), 0);
  return MustRefuse({ErrorCode::kInvalidArgument}, [&] {
    NullObserver silent;
    NoCheckpoints none;
    TrainGeometry(GeometryProblemOf(scene, images), {}, {pool, none, silent, CancellationToken()});
  });
}

void AddRefusals(std::vector<StabilityCase>& cases) {
  const auto add = [&](const std::string& name, std::function<StabilityResult(ThreadPool&)> run) {
    cases.push_back({"geometry", name, false, std::move(run)});
  };
  add("all points behind the cameras", PointsBehindCameras);
  add("no sparse points", [](ThreadPool&) {
    return MustRefuse({ErrorCode::kInvalidArgument}, [] { InitialGaussians(Scene()); });
  });
  add("no views", [](ThreadPool& pool) {
    return MustRefuse({ErrorCode::kInvalidArgument}, [&] {
      Training t = Ordinary();
      t.cameras.clear();
      NullObserver silent;
      Train(t, silent, pool);
    });
  });
  add("a sparse point that is NaN", [](ThreadPool&) {
    return MustRefuse({ErrorCode::kInvalidArgument}, [] {
      Scene scene;
      scene.points.resize(3);
      scene.points[1].position.x() = std::numeric_limits<double>::quiet_NaN();
      InitialGaussians(scene);
    });
  });
  add("a learning rate beyond its range", [](ThreadPool& pool) {
    return MustRefuse({ErrorCode::kInvalidArgument}, [&] {
      NullObserver silent;
      Train(OfRate(1e30), silent, pool);
    });
  });
}

}  // namespace

void AddGeometryCases(std::vector<StabilityCase>& cases) {
  const auto add = [&](const std::string& name, std::function<Training()> make) {
    cases.push_back(
        {"geometry", name, false, [make](ThreadPool& pool) { return RunTraining(make(), pool); }});
  };
  add("ordinary", Ordinary);
  add("black photos", [] { return OfConstant(0.0f); });
  add("grey photos", [] { return OfConstant(50.0f); });
  add("white photos", [] { return OfConstant(100.0f); });
  add("one view", [] { return OfViews(1, 0.0, false); });
  add("two views", [] { return OfViews(2, 0.3, false); });
  add("all views identical", [] { return OfViews(4, 0.0, false); });
  add("views without overlap", [] { return OfViews(4, 0.1, true); });
  add("one Gaussian", [] {
    Training t = Ordinary();
    t.initial = CloudOf(1, 1);
    return t;
  });
  add("all Gaussians at one place", OfDuplicates);
  add("extreme start", OfHardStart);
  add("photos of 1x1 px", [] { return OfPictureSize(1, 1); });
  add("photos of 17x5 px", [] { return OfPictureSize(17, 5); });
  add("learning rates 100 times too large", [] { return OfRate(100.0); });
  add("learning rates 1000 times too large", [] { return OfRate(1000.0); });
  AddRefusals(cases);
  cases.push_back({"geometry", "a photo with a NaN pixel", false, [](ThreadPool& pool) {
                     return MustRefuse({ErrorCode::kInvalidArgument}, [&] {
                       NullObserver silent;
                       Train(OfSpoiltPhoto(), silent, pool);
                     });
                   }});
  cases.push_back({"geometry", "steps that overflow float32", false, [](ThreadPool& pool) {
                     Training t = OfRate(1000.0);
                     t.extent = 3.2e38;
                     StabilityResult result = RunTraining(t, pool);
                     result.held = result.held && result.restores > 0;
                     return result;
                   }});
}

}  // namespace color3d
