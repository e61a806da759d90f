#include "core/splat/training/trainer.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "core/base/error.h"
#include "core/base/range_check.h"
#include "core/splat/chroma/chroma_fit.h"
#include "core/splat/geometry/geometry_trainer.h"
#include "core/splat/raster/projection.h"

namespace color3d {
namespace {

constexpr int kMaxSampledViews = 8;  // per sparse point
constexpr float kShDc = 0.28209479177387814f;

std::vector<PosedCamera> Posed(const Scene& scene,
                               const ViewImages& images,
                               const std::vector<int>& views) {
  std::vector<PosedCamera> posed;
  for (const int view : views) {
    posed.push_back({view, images.WorkingCamera(view), scene.views[view].cam_from_world});
  }
  return posed;
}

// Pixel of a world point, or false when it is not in front of the camera or not in the picture.
bool PixelOf(const PosedCamera& view, const Eigen::Vector3d& world, int* x, int* y) {
  const Eigen::Vector3d p = view.cam_from_world.Apply(world);
  if (!(p.z() > kNearPlane)) return false;
  const Eigen::Vector2d pixel = view.camera.Project(p);
  if (!view.camera.Contains(pixel)) return false;
  *x = static_cast<int>(pixel.x());
  *y = static_cast<int>(pixel.y());
  return true;
}

// Colour of each sparse point where training views observe it, as a better start than grey. View by
// view, so that each picture is read once. Returns how many points some training view has before
// it.
size_t SampleInitialColours(const Scene& scene,
                            const GeometryProblem& problem,
                            GaussianModel& model) {
  const bool srgb = static_cast<bool>(problem.colours);
  const int channels = srgb ? 3 : 1;
  std::vector<double> sum(scene.points.size() * channels, 0.0);
  std::vector<int> count(scene.points.size(), 0);
  std::vector<char> in_front(scene.points.size(), 0);
  for (const PosedCamera& view : problem.training) {
    const std::shared_ptr<const Image> picture =
        srgb ? problem.colours(view.view) : problem.luminance(view.view);
    for (size_t i = 0; i < scene.points.size(); ++i) {
      const SparsePoint& point = scene.points[i];
      int x = 0, y = 0;
      if (!PixelOf(view, point.position, &x, &y)) continue;
      in_front[i] = 1;
      if (count[i] >= kMaxSampledViews ||
          !std::binary_search(point.views.begin(), point.views.end(), view.view)) {
        continue;
      }
      for (int c = 0; c < channels; ++c) sum[i * channels + c] += picture->At(c, y, x);
      ++count[i];
    }
  }
  model.channels = channels;
  if (srgb) model.sh_a = model.sh_b = model.sh_l;
  std::vector<float>* const sh[3] = {&model.sh_l, &model.sh_a, &model.sh_b};
  for (size_t i = 0; i < scene.points.size(); ++i) {
    if (count[i] == 0) continue;
    for (int c = 0; c < channels; ++c) {
      const float value =
          static_cast<float>((srgb ? 1.0 : 0.01) * sum[i * channels + c] / count[i]);
      if (std::isfinite(value)) (*sh[c])[i] = (value - 0.5f) / kShDc;
    }
  }
  return static_cast<size_t>(std::count(in_front.begin(), in_front.end(), 1));
}

}  // namespace

void GeometryOptions::Validate() const {
  const RangeCheck check("geometry option");
  check("iterations", iterations, 0, 100'000);
  check("time_limit_seconds", time_limit_seconds, 0.0, 86'400.0);
  check("max_gaussians", max_gaussians, 1, 10'000'000);
  check("sh_degree", sh_degree, 0, 3);
  check("ssim_weight", ssim_weight, 0.0, 1.0);
  check("edge_weight", edge_weight, 0.0, 10.0);
  check("densify_gradient", densify_gradient, 1e-9, 1e9);
  check("learning_rate_scale", learning_rate_scale, 1e-3, 1e3);
}

void ChromaOptions::Validate() const {
  const RangeCheck check("chroma option");
  check("iterations", iterations, 0, 100'000);
  check("chroma_sh_degree", chroma_sh_degree, 0, 1);
  check("ssim_weight", ssim_weight, 0.0, 1.0);
  check("time_limit_seconds", time_limit_seconds, 0.0, 86'400.0);
  check("sweeps", sweeps, 0, 1000);
  check("rounds", rounds, 0, 1000);
  check("steps_per_round", steps_per_round, 1, 1000);
  check("residual_tolerance", residual_tolerance, 0.0, 1.0);
  check("objective_tolerance", objective_tolerance, 0.0, 1.0);
  check("tikhonov", tikhonov, 1e-6, 1e6);
  check("tikhonov_rest", tikhonov_rest, 1.0, 1e6);
  check("memory_budget_bytes", static_cast<double>(memory_budget_bytes), 0.0, 1e15);
}

GaussianModel TrainGeometry(const Scene& scene,
                            const ViewImages& images,
                            const GeometryOptions& options,
                            ThreadPool& pool,
                            CheckpointStore& checkpoints,
                            ProgressObserver& progress,
                            const CancellationToken& cancel) {
  return TrainGeometryTuned(scene,
                            images,
                            options,
                            TuningOf(options),
                            TrainingColours::kLuminance,
                            pool,
                            checkpoints,
                            progress,
                            cancel,
                            nullptr);
}

GaussianModel TrainGeometryTuned(const Scene& scene,
                                 const ViewImages& images,
                                 const GeometryOptions& options,
                                 const GeometryTuning& tuning,
                                 TrainingColours colours,
                                 ThreadPool& pool,
                                 CheckpointStore& checkpoints,
                                 ProgressObserver& progress,
                                 const CancellationToken& cancel,
                                 TrainingTrace* trace) {
  options.Validate();
  GeometryProblem problem;
  problem.training = Posed(scene, images, scene.TrainingViews());
  problem.held_out = Posed(scene, images, scene.HeldOutViews());
  problem.luminance = [&images](int view) { return images.Luminance(view); };
  if (colours == TrainingColours::kSrgb) {
    // Decoded once; every level of the pyramid asks again.
    problem.colours = [&images,
                       kept = std::map<int, std::shared_ptr<const Image>>()](int view) mutable {
      std::shared_ptr<const Image>& picture = kept[view];
      if (picture == nullptr) picture = std::make_shared<const Image>(images.Srgb(view));
      return picture;
    };
  }
  problem.extent = scene.Extent();
  GaussianModel initial = InitialGaussians(scene);
  if (SampleInitialColours(scene, problem, initial) == 0) {
    throw InvalidArgument("none of the " + std::to_string(scene.points.size()) +
                          " sparse points lies in front of a training camera (nearer than " +
                          std::to_string(kNearPlane) +
                          " world units does not count); check the poses and the scene's scale");
  }
  return TrainGeometryOn(
      problem, initial, options, tuning, pool, checkpoints, progress, cancel, trace);
}

GaussianModel FitChroma(const GaussianModel& geometry,
                        const Scene& scene,
                        const ViewImages& images,
                        const ChromaTargetSource& targets,
                        const ChromaOptions& options,
                        ThreadPool& pool,
                        CheckpointStore& checkpoints,
                        ProgressObserver& progress,
                        const CancellationToken& cancel) {
  ChromaProblem problem;
  problem.training = Posed(scene, images, scene.TrainingViews());
  problem.targets = targets;
  return FitChromaOn(geometry, problem, options, pool, checkpoints, progress, cancel);
}

}  // namespace color3d
