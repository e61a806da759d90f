// Luminance geometry training on plain inputs (no files): the engine behind TrainGeometry. Internal
// to the splat module.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/parallel.h"
#include "core/base/progress.h"
#include "core/splat/gaussian_model.h"
#include "core/splat/trainer.h"

namespace color3d {

struct PosedCamera {
  int view = 0;  // what the luminance source is asked for
  Camera camera;
  Pose cam_from_world;
};

// 1 channel, L in 0..100, the size of the view's camera.
using LuminanceSource = std::function<std::shared_ptr<const Image>(int view)>;

struct GeometryProblem {
  std::vector<PosedCamera> training;
  std::vector<PosedCamera> held_out;
  LuminanceSource luminance;
  double extent = 1.0;
};

// How the schedule is spent. Fractions are of options.iterations. The defaults are measured.
struct GeometryTuning {
  enum class Strategy { kAdaptive, kRelocate };
  Strategy strategy = Strategy::kAdaptive;
  double quarter_size_until = 0.0;  // train at 1/4, then 1/2 of the working size
  double half_size_until = 0.35;
  double densify_from = 0.05;
  double densify_until = 0.6;
  int densify_rounds = 30;
  double gradient_preference = 1.0;  // RelocationOptions
  double growth_until = 0.5;         // the number of Gaussians reaches its cap here
  int opacity_resets = 0;
  double opacity_penalty = 0.005;  // times the mean opacity
  double scale_penalty = 0.005;    // times the mean scale / extent
  double noise = 5e5;              // of 3DGS-MCMC, times the position's learning rate
  double sh_from = 0.3;            // degree 1 begins here
  double sh_step = 0.15;           // and each further degree this much later
  double position_rate_first = 1.6e-4;
  double position_rate_last = 1.6e-6;
  double dc_rate = 2.5e-3;
  double rest_divisor = 20.0;
  double opacity_rate = 0.05;
  double scale_rate = 5e-3;
  double rotation_rate = 1e-3;
  double ssim_scale = 1.0;
};

// As TrainGeometry. `initial` has 1 channel; its spherical harmonics are extended to the options'
// degree.
GaussianModel TrainGeometryOn(const GeometryProblem& problem,
                              const GaussianModel& initial,
                              const GeometryOptions& options,
                              const GeometryTuning& tuning,
                              ThreadPool& pool,
                              CheckpointStore& checkpoints,
                              ProgressObserver& progress,
                              const CancellationToken& cancel);

// TrainGeometry with another schedule, for measurements.
GaussianModel TrainGeometryTuned(const Scene& scene,
                                 const ViewImages& images,
                                 const GeometryOptions& options,
                                 const GeometryTuning& tuning,
                                 ThreadPool& pool,
                                 CheckpointStore& checkpoints,
                                 ProgressObserver& progress,
                                 const CancellationToken& cancel);

}  // namespace color3d
