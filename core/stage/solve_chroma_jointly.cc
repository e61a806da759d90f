#include "core/stage/solve_chroma_jointly.h"

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/scene/masks/masked_points.h"
#include "core/scene/view_images.h"
#include "core/splat/geometry/geometry_trainer.h"
#include "core/splat/geometry/warm_up.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {
namespace {

constexpr double kMaxLimitSeconds = 86'400.0;  // GeometryOptions::Validate

WarmUp ReadWarmUp(const StageContext& context) {
  if (!context.HasInput(artifact::kWarmUp)) {
    throw Error(ErrorCode::kFailedPrecondition,
                "solve_chroma.solver is joint, but reconstruct_geometry trained to the end; give "
                "reconstruct_geometry.recipe=paper and warm_up below 1 (the paper: 0.5), "
                "or choose another solver");
  }
  return ParseWarmUp(context.ReadInput(artifact::kWarmUp));
}

// The captured luminance with the target colours of the views. The references outlive it.
class ColoredViews {
 public:
  ColoredViews(const Scene& scene, int key_view, const ViewImages& images, StageContext& context)
      : scene_(scene), key_view_(key_view), images_(images), context_(context) {}

  Image Lab(int view) const {
    const std::shared_ptr<const Image> l = images_.Luminance(view);
    const Image ab =
        ReadTargetAb(context_, scene_.views[view], view == key_view_, l->width, l->height);
    Image lab(l->width, l->height, 3);
    std::copy_n(l->Plane(0), l->PlaneSize(), lab.Plane(0));
    std::copy_n(ab.Plane(0), 2 * ab.PlaneSize(), lab.Plane(1));
    return lab;
  }

  // L', a', b', each 0..1.
  PictureSource Normalized() const {
    return [this](int view) {
      Image lab = Lab(view);
      float* l = lab.Plane(0);
      float* ab = lab.Plane(1);
      std::transform(l, l + lab.PlaneSize(), l, [](float v) { return v / 100.0f; });
      std::transform(
          ab, ab + 2 * lab.PlaneSize(), ab, [](float v) { return v / 255.0f + kNeutralChroma; });
      return std::make_shared<const Image>(std::move(lab));
    };
  }

  PictureSource Srgb() const {
    return [this](int view) { return std::make_shared<const Image>(SrgbFromLab(Lab(view))); };
  }

 private:
  const Scene& scene_;
  const int key_view_;
  const ViewImages& images_;
  StageContext& context_;
};

GeometryProblem ProblemOf(const ChromaOptions& options,
                          const WarmUp& warm_up,
                          const Scene& scene,
                          const ViewImages& images,
                          const ColoredViews& colored) {
  GeometryProblem problem;
  if (options.color_space == ColorSpace::kSrgb) {
    Scene unmasked = scene;
    unmasked.points = UnmaskedPoints(scene, images);
    problem = GeometryProblemOf(unmasked, images, colored.Srgb());
  } else {
    problem = GeometryProblemWithoutStart(scene, images);
    problem.colors = colored.Normalized();
    problem.color_space = ColorSpace::kLab;
    problem.chroma_sh_degree = options.chroma_sh_degree;
    problem.start = &warm_up.state;
  }
  problem.held_out.clear();  // their true colours are unknown
  problem.picture_cache_bytes = warm_up.picture_cache_bytes;
  return problem;
}

// The options of the whole training; the limit of this stage begins at its start.
GeometryOptions TrainingOptions(const ChromaOptions& options, const WarmUp& warm_up) {
  GeometryOptions training = warm_up.options;
  if (options.time_limit_seconds > 0.0) {
    const double before =
        options.color_space == ColorSpace::kLab ? warm_up.state.elapsed_seconds : 0.0;
    const double until = std::min(kMaxLimitSeconds, before + options.time_limit_seconds);
    training.time_limit_seconds =
        training.time_limit_seconds > 0.0 ? std::min(training.time_limit_seconds, until) : until;
  }
  return training;
}

}  // namespace

GaussianModel SolveChromaJointly(const ChromaOptions& options,
                                 const Scene& scene,
                                 int key_view,
                                 StageContext& context) {
  const WarmUp warm_up = ReadWarmUp(context);
  const bool lab = options.color_space == ColorSpace::kLab;
  const ViewImages images(scene, context.scene_folder(), warm_up.max_side_px, 0);
  const ColoredViews colored(scene, key_view, images, context);
  const GeometryProblem problem = ProblemOf(options, warm_up, scene, images, colored);
  GeometryState end;
  GaussianModel model =
      TrainGeometry(problem, TrainingOptions(options, warm_up), context.control(), nullptr, &end);
  context.WriteOutput(
      artifact::kJointTraining,
      nlohmann::ordered_json{{"color_space", lab ? "lab" : "rgb"},
                             {"chroma_sh_degree", model.chroma_sh_degree},
                             {"iterations", end.iteration},
                             {"gaussians", model.size()},
                             {"seconds", end.elapsed_seconds},
                             {"warm_up_iterations", lab ? warm_up.state.iteration : 0},
                             {"warm_up_gaussians", lab ? warm_up.state.parameters.count() : 0},
                             {"warm_up_seconds", lab ? warm_up.state.elapsed_seconds : 0.0}}
              .dump(1) +
          "\n");
  context.ReportProgress(end.iteration,
                         end.iteration,
                         fmt::format("{} Gaussians in {} after {:.1f} s of training{}",
                                     model.size(),
                                     lab ? "Lab" : "RGB",
                                     end.elapsed_seconds,
                                     lab ? ", warm-up included" : ""));
  return model;
}

}  // namespace color3d
