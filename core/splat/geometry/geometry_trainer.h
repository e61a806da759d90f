// Geometry training on plain inputs (no files): the engine behind TrainGeometry. Internal
// to the splat module.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/parallel.h"
#include "core/base/progress.h"
#include "core/splat/geometry/training_schedule.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/raster/phase_clock.h"
#include "core/splat/training/trainer.h"

namespace color3d {

struct PosedCamera {
  int view = 0;  // what the luminance source is asked for
  Camera camera;
  Pose cam_from_world;
};

// A picture of the size of the view's camera.
using PictureSource = std::function<std::shared_ptr<const Image>(int view)>;

struct GeometryProblem {
  std::vector<PosedCamera> training;
  std::vector<PosedCamera> held_out;
  PictureSource luminance;  // 1 channel, L in 0..100
  PictureSource colours;    // 3 channels, sRGB 0..1; when set, trained on in place of luminance
  double extent = 1.0;
};

// Quality over the held-out views, at a moment of training. Pictures are compared after clamping to
// 0..1; each view counts the same.
struct HeldOutPoint {
  double seconds = 0.0;  // of training
  int64_t iteration = 0;
  int64_t gaussians = 0;
  double psnr_db = 0.0;  // from the squared error over all channels
  double ssim = 0.0;
  double l1 = 0.0;  // of values 0..1
};

// What training leaves for whoever measures it.
struct TrainingTrace {
  // Called at the end for each held-out view, in order: the model's picture, clamped to 0..1.
  std::function<void(int view, const Image& drawn)> on_held_out_picture;
  double seconds = 0.0;  // of training in this attempt, held-out evaluation not counted
  int64_t iterations = 0;
  int64_t gaussians = 0;
  PhaseSeconds phases{};
  std::vector<HeldOutPoint> held_out;
};

// As TrainGeometry. `initial` has 1 or 3 channels of any degree; its spherical harmonics are cut or
// extended to the options' degree. On colours the result has 3 channels, and sh_l, sh_a, sh_b are
// those of R, G, B, all around 0.5. `trace` may be null.
GaussianModel TrainGeometryOn(const GeometryProblem& problem,
                              const GaussianModel& initial,
                              const GeometryOptions& options,
                              const GeometryTuning& tuning,
                              ThreadPool& pool,
                              CheckpointStore& checkpoints,
                              ProgressObserver& progress,
                              const CancellationToken& cancel,
                              TrainingTrace* trace = nullptr);

// TrainGeometry with another schedule and on true colours if wanted, for measurements.
enum class TrainingColours { kLuminance, kSrgb };
GaussianModel TrainGeometryTuned(const Scene& scene,
                                 const ViewImages& images,
                                 const GeometryOptions& options,
                                 const GeometryTuning& tuning,
                                 TrainingColours colours,
                                 ThreadPool& pool,
                                 CheckpointStore& checkpoints,
                                 ProgressObserver& progress,
                                 const CancellationToken& cancel,
                                 TrainingTrace* trace);

}  // namespace color3d
