#include "core/splat/geometry/geometry_problem.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "core/base/error.h"
#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/raster/raster_constants.h"

namespace color3d {
namespace {

constexpr int kMaxSampledViews = 8;  // per sparse point

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

// Colour of each sparse point in the training views that observe it, as a better start than grey.
// Iterates over views, so that each picture is read once. Returns the number of points in front of
// some training view.
size_t SampleInitialColors(const Scene& scene, GeometryProblem& problem) {
  const bool srgb = static_cast<bool>(problem.colors);
  const int channels = srgb ? 3 : 1;
  std::vector<double> sum(scene.points.size() * channels, 0.0);
  std::vector<int> count(scene.points.size(), 0);
  std::vector<char> in_front(scene.points.size(), 0);
  for (const PosedCamera& view : problem.training) {
    const std::shared_ptr<const Image> mask = problem.mask ? problem.mask(view.view) : nullptr;
    const std::shared_ptr<const Image> picture =
        srgb ? problem.colors(view.view) : problem.luminance(view.view);
    for (size_t i = 0; i < scene.points.size(); ++i) {
      const SparsePoint& point = scene.points[i];
      int x = 0, y = 0;
      if (!PixelOf(view, point.position, &x, &y)) continue;
      in_front[i] = 1;
      if (mask != nullptr && mask->At(0, y, x) == 0.0f) continue;
      if (count[i] >= kMaxSampledViews ||
          !std::binary_search(point.views.begin(), point.views.end(), view.view)) {
        continue;
      }
      for (int c = 0; c < channels; ++c) sum[i * channels + c] += picture->At(c, y, x);
      ++count[i];
    }
  }
  GaussianModel& model = problem.initial;
  model.channels = channels;
  if (srgb) {
    model.color_space = ColorSpace::kSrgb;
    model.sh_a = model.sh_b = model.sh_l;
  }
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

ColorLayout TrainedLayout(const GeometryProblem& problem, const GeometryOptions& options) {
  const int degree = options.sh_degree;
  if (!problem.colors) return {ColorSpace::kLab, 1, degree, 0};
  if (problem.color_space == ColorSpace::kSrgb) return {ColorSpace::kSrgb, 3, degree, degree};
  if (problem.chroma_sh_degree > degree) {
    throw InvalidArgument(
        "chroma_sh_degree {} is above the degree {} of luminance, from which a and b start; lower "
        "it or raise reconstruct_geometry.sh_degree",
        problem.chroma_sh_degree,
        degree);
  }
  if (problem.start == nullptr) {
    throw InvalidArgument("training on luminance and chroma starts from a warm-up; give its state");
  }
  return {ColorSpace::kLab, 3, degree, problem.chroma_sh_degree};
}

GeometryProblem GeometryProblemWithoutStart(const Scene& scene, const ViewImages& images) {
  GeometryProblem problem;
  problem.training = PosedCameras(scene, images, scene.TrainingViews());
  problem.held_out = PosedCameras(scene, images, scene.HeldOutViews());
  problem.luminance = [&images](int view) { return images.Luminance(view); };
  if (std::any_of(scene.views.begin(), scene.views.end(), [](const View& view) {
        return !view.mask_file.empty();
      })) {
    problem.mask = [&images](int view) { return images.Mask(view); };
  }
  problem.extent = scene.Extent();
  problem.is_relief = scene.relief.has_value();
  return problem;
}

GeometryProblem GeometryProblemOf(const Scene& scene,
                                  const ViewImages& images,
                                  PictureSource srgb) {
  GeometryProblem problem = GeometryProblemWithoutStart(scene, images);
  problem.colors = std::move(srgb);
  problem.initial = InitialGaussians(scene);
  if (SampleInitialColors(scene, problem) == 0) {
    throw InvalidArgument(
        "none of the {} sparse points lies in front of a training camera (nearer than {} world "
        "units does not count); check the poses and the scene's scale",
        scene.points.size(),
        kNearPlane);
  }
  return problem;
}

GeometryProblem GeometryProblemOf(const Scene& scene,
                                  const ViewImages& images,
                                  TrainingColors colors) {
  if (colors == TrainingColors::kLuminance) return GeometryProblemOf(scene, images);
  // Decoded once, because every pyramid level reads it.
  return GeometryProblemOf(
      scene,
      images,
      [&images, kept = std::map<int, std::shared_ptr<const Image>>()](int view) mutable {
        std::shared_ptr<const Image>& picture = kept[view];
        if (picture == nullptr) picture = std::make_shared<const Image>(images.Srgb(view));
        return picture;
      });
}

}  // namespace color3d
