// color3d-bench floor: lower bound of the error of any colourizer. Carries the true colours of all
// training views into each held-out view by geometry, stereo and optical flow. Remaining
// differences in chroma are gloss, exposure, noise and misregistration. Fitting gain and offset of
// chroma of each photo to the held-out view removes exposure.
#include <Eigen/Dense>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/carry/carry_views.h"
#include "core/carry/fusion.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/splat/raster/render.h"
#include "core/stage/formats/artifact_io.h"
#include "tests/bench/commands.h"

namespace color3d {
namespace {

struct Arguments {
  std::string scene_folder, run_folder;
  int side_px = 400;
  int threads = 2;
};

constexpr float kCarried = 0.25f;  // confidence from which a pixel counts

// Sums of errors over pixels.
struct Error {
  double sum = 0.0;
  double count = 0.0;
  double Mean() const { return count > 0.0 ? sum / count : 0.0; }
};

struct Errors {
  Error carried, all, nearest;  // nearest: the single view of highest coverage
};

LabColor At(const Image& truth, const Image& ab, size_t i) {
  return {truth.Plane(0)[i], ab.Plane(0)[i], ab.Plane(1)[i]};
}

void AddErrors(const Image& truth, const CarriedColor& color, float least, Error* error) {
  for (size_t i = 0; i < color.confidence.data.size(); ++i) {
    if (color.confidence.data[i] < least) continue;
    const LabColor is{truth.Plane(0)[i], truth.Plane(1)[i], truth.Plane(2)[i]};
    error->sum += DeltaE00(is, At(truth, color.ab, i));
    error->count += 1.0;
  }
}

// Fits a gain and offsets of a and b by weighted least squares where colour is carried.
void FitChromaTo(const Image& truth, CarriedColor* color) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() * 1e-6;
  Eigen::Vector3d right = Eigen::Vector3d(1e-6, 0, 0);
  for (size_t i = 0; i < color->confidence.data.size(); ++i) {
    const double weight = color->confidence.data[i];
    if (weight < kCarried) continue;
    for (int c = 0; c < 2; ++c) {
      const Eigen::Vector3d row(color->ab.Plane(c)[i], c == 0 ? 1.0 : 0.0, c == 1 ? 1.0 : 0.0);
      normal += weight * row * row.transpose();
      right += weight * row * truth.Plane(1 + c)[i];
    }
  }
  const Eigen::Vector3d fit = normal.ldlt().solve(right);
  for (int c = 0; c < 2; ++c) {
    float* plane = color->ab.Plane(c);
    for (size_t i = 0; i < color->confidence.data.size(); ++i) {
      plane[i] = static_cast<float>(fit[0] * plane[i] + fit[1 + c]);
    }
  }
}

// Combines all views, the most confident first.
CarriedColor Together(std::vector<CarriedColor> colors) {
  std::stable_sort(colors.begin(), colors.end(), [](const auto& x, const auto& y) {
    return Coverage(x, kCarried) > Coverage(y, kCarried);
  });
  CarriedColor all = colors[0];
  for (size_t i = 1; i < colors.size(); ++i) FillFrom(colors[i], &all);
  return all;
}

// Mean weighted by confidence, which averages out noise and misregistration.
CarriedColor Averaged(const std::vector<CarriedColor>& colors) {
  CarriedColor mean = colors[0];
  for (size_t i = 0; i < mean.confidence.data.size(); ++i) {
    double weight = 0.0, a = 0.0, b = 0.0, most = 0.0;
    for (const CarriedColor& color : colors) {
      const double w = color.confidence.data[i];
      weight += w, a += w * color.ab.Plane(0)[i], b += w * color.ab.Plane(1)[i];
      most = std::max(most, w);
    }
    mean.confidence.data[i] = static_cast<float>(most);
    mean.ab.Plane(0)[i] = weight > 0.0 ? static_cast<float>(a / weight) : 0.0f;
    mean.ab.Plane(1)[i] = weight > 0.0 ? static_cast<float>(b / weight) : 0.0f;
  }
  return mean;
}

// Fills pixels without carried colour from their surroundings.
void AddErrorsOfAll(const Image& truth, const CarriedColor& color, ThreadPool& pool, Error* error) {
  double sums[3] = {0.0, 0.0, 1e-9};
  for (size_t i = 0; i < color.confidence.data.size(); ++i) {
    const double c = color.confidence.data[i];
    sums[0] += c * color.ab.Plane(0)[i], sums[1] += c * color.ab.Plane(1)[i], sums[2] += c;
  }
  Image mean(truth.width, truth.height, 2);
  for (int c = 0; c < 2; ++c) {
    std::fill_n(mean.Plane(c), mean.PlaneSize(), static_cast<float>(sums[c] / sums[2]));
  }
  const FusedColor fused =
      FuseColors({LuminanceOfLab(truth), color, mean, {}, {}}, FusionOptions{}, pool, {});
  AddErrors(truth, {fused.ab, Image(truth.width, truth.height, 1, 1.0f)}, 0.0f, error);
}

void Run(const Arguments& args) {
  const std::filesystem::path folder = args.scene_folder, run = args.run_folder;
  const Scene scene = SceneFromJson(ReadFile(run / artifact::kScene));
  const GaussianModel geometry = ParseGaussians(ReadFile(run / artifact::kGeometry));
  const ViewImages images(scene, folder, args.side_px);
  const ViewImages sweep_images(scene, folder, 300);
  const CancellationToken cancel;
  const SurfaceRenderer render = [&](int view, const Camera& camera) {
    ThreadPool one(1);
    RenderedView seen = RenderView(geometry, camera, scene.views[view].cam_from_world, one);
    return RenderedSurface{std::move(seen.depth), std::move(seen.opacity)};
  };
  const SurfaceMaker maker(scene, images, sweep_images, render, 4, PlaneSweepOptions{}, cancel);
  ThreadPool pool(args.threads);
  std::vector<ViewSurfaces> surfaces(scene.views.size());
  std::vector<Image> truth(scene.views.size());
  pool.ForEach(static_cast<int64_t>(scene.views.size()), [&](int64_t i, int) {
    const int view = static_cast<int>(i);
    surfaces[view] = maker.Make(view);
    truth[view] =
        LabFromSrgb(images.Undistort(view, ReadImage(folder / scene.views[view].image_file)));
  });
  const std::vector<int> training = scene.TrainingViews();
  std::map<std::string, Errors> errors;
  Error gray;
  double covered = 0.0;
  for (const int target : scene.HeldOutViews()) {
    std::vector<CarriedColor> raw(training.size());
    pool.ForEach(static_cast<int64_t>(training.size()), [&](int64_t k, int) {
      const int source = training[k];
      const Image ab = ChromaOfLab(truth[source]);
      const CarryOptions options;
      raw[k] = CarryColor(surfaces[source].rendered, ab, {}, surfaces[target].rendered, options);
      if (surfaces[source].swept && surfaces[target].swept) {
        KeepMoreConfident(
            CarryColor(*surfaces[source].swept, ab, {}, *surfaces[target].swept, options), &raw[k]);
      }
    });
    std::vector<CarriedColor> fitted = raw;
    for (CarriedColor& color : fitted) FitChromaTo(truth[target], &color);
    const Image flat(truth[target].width, truth[target].height, 2);
    AddErrors(truth[target], {flat, Image(flat.width, flat.height, 1, 1.0f)}, 0.0f, &gray);
    covered += Coverage(Together(raw), kCarried) / static_cast<double>(scene.HeldOutViews().size());
    for (const auto& [name, colors] :
         {std::pair<std::string, const std::vector<CarriedColor>&>{"as_taken", raw},
          {"exposure_fitted", fitted}}) {
      for (const auto& [how, color] :
           {std::pair<std::string, CarriedColor>{"surest", Together(colors)},
            {"mean", Averaged(colors)}}) {
        Errors& e = errors[name + "_" + how];
        AddErrors(truth[target], color, kCarried, &e.carried);
        AddErrorsOfAll(truth[target], color, pool, &e.all);
      }
      const auto nearest =
          std::max_element(colors.begin(), colors.end(), [](const auto& x, const auto& y) {
            return Coverage(x, kCarried) < Coverage(y, kCarried);
          });
      AddErrors(truth[target], *nearest, kCarried, &errors[name + "_surest"].nearest);
    }
  }
  nlohmann::ordered_json json{{"delta_e00_gray", gray.Mean()}, {"share_carried", covered}};
  for (const auto& [name, e] : errors) {
    json[name] = {{"delta_e00_carried", e.carried.Mean()}, {"delta_e00_all", e.all.Mean()}};
    if (e.nearest.count > 0.0) json[name]["delta_e00_of_one_view"] = e.nearest.Mean();
  }
  std::printf("%s\n", json.dump(1).c_str());
}

}  // namespace

void AddFloorCommand(CLI::App& app) {
  auto args = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("floor",
                                         "Measure the error that remains with the true colours of "
                                         "all training views carried into held-out views");
  command
      ->add_option("--scene", args->scene_folder, "Folder of colour photos, with or without poses")
      ->required();
  command->add_option("--run", args->run_folder, "Output folder of a `pipeline` run")->required();
  command->add_option("--side", args->side_px, "Longer side of the pictures, px");
  command->add_option("--threads", args->threads, "Number of threads");
  command->callback([args] { Run(*args); });
}

}  // namespace color3d
