#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/metrics/quality.h"
#include "core/scene/view_images.h"
#include "core/splat/render.h"
#include "core/stage/artifacts.h"
#include "core/stage/stages.h"

namespace color3d {
namespace {

constexpr int kColorSidePx = 400;  // colour differences are measured at this size

Image Plane(const Image& image, int first, int count) {
  Image planes(image.width, image.height, count);
  std::copy_n(image.Plane(first), planes.data.size(), planes.data.begin());
  return planes;
}

// True L with other chroma: a colour error that a luminance error cannot hide.
Image UnderTrueL(const Image& true_lab, const Image& ab) {
  return JoinLab(Plane(true_lab, 0, 1), ab);
}

using Scores = std::map<std::string, double>;

Scores ScoreView(const Image& true_srgb, const Image& rendered_lab, const Image& view_ab) {
  Scores v;
  const Image true_lab = LabFromSrgb(true_srgb);
  const Image rendered_srgb = SrgbFromLab(rendered_lab);
  v["psnr_rgb"] = Psnr(rendered_srgb, true_srgb, 1.0);
  v["ssim_rgb"] = Ssim(rendered_srgb, true_srgb, 1.0);
  v["psnr_l"] = Psnr(Plane(rendered_lab, 0, 1), Plane(true_lab, 0, 1), 100.0);
  v["ab_rmse"] = AbRmse(rendered_lab, true_lab);
  v["colourfulness"] = Colourfulness(rendered_srgb);
  v["colourfulness_truth"] = Colourfulness(true_srgb);

  const Image truth = FitWithin(true_lab, kColorSidePx);
  const Image rendered = FitWithin(rendered_lab, kColorSidePx);
  const Image direct = FitWithin(view_ab, kColorSidePx);
  v["delta_e00"] = MeanDeltaE00(rendered, truth);
  v["delta_e00_chroma"] = MeanDeltaE00(UnderTrueL(truth, Plane(rendered, 1, 2)), truth);
  v["delta_e00_chroma_2d"] = MeanDeltaE00(UnderTrueL(truth, direct), truth);
  v["delta_e00_grey"] = MeanDeltaE00(UnderTrueL(truth, Image(truth.width, truth.height, 2)), truth);
  return v;
}

}  // namespace

void RunEvaluate(const std::vector<TruthFile>& truth, StageContext& context) {
  if (truth.empty()) throw InvalidArgument("there is no truth to evaluate against");
  const Scene scene = ReadScene(context);
  const GaussianModel model = ParseGaussians(context.ReadInput(artifact::kModel));
  ThreadPool pool(context.threads());
  nlohmann::ordered_json per_view = nlohmann::ordered_json::array();
  std::map<std::string, double> mean;
  for (size_t i = 0; i < truth.size(); ++i) {
    context.cancel().ThrowIfCancelled();
    const int index = scene.FindView(truth[i].view);
    const View& view = scene.views[index];
    if (!view.held_out) {
      throw InvalidArgument("truth was given for " + view.name +
                            ", which is a training view; only held-out views are scored");
    }
    const std::string ab_name = ViewArtifact(artifact::kViewsAb, view, ".png");
    const AbMap map = DecodeAbPng(context.ReadInput(ab_name), ab_name);
    const int side = std::max(map.ab.width, map.ab.height);
    const ViewImages images(scene, context.scene_folder(), side, 0);
    const Image captured = ReadImage(truth[i].file);
    if (captured.channels != 3) throw InvalidArgument("the truth of " + view.name + " is grey");
    const Image true_srgb = images.Undistort(index, captured);
    const RenderedView rendered =
        RenderView(model, images.WorkingCamera(index), view.cam_from_world, pool);
    const Scores scores = ScoreView(true_srgb, rendered.lab, map.ab);
    nlohmann::ordered_json entry{{"view", view.name}};
    for (const auto& [name, value] : scores) {
      entry[name] = value;
      mean[name] += value / static_cast<double>(truth.size());
    }
    per_view.push_back(std::move(entry));
    const Image colored = SrgbFromLab(JoinLab(Plane(LabFromSrgb(true_srgb), 0, 1), map.ab));
    context.WriteOutput(ViewArtifact(artifact::kTruths, view, ".jpg"), EncodeJpeg(true_srgb));
    context.WriteOutput(ViewArtifact(artifact::kColored2d, view, ".jpg"), EncodeJpeg(colored));
    context.progress().OnProgress(
        static_cast<int64_t>(i) + 1, static_cast<int64_t>(truth.size()), "scoring " + view.name);
  }
  for (const auto& [name, value] : mean) context.progress().OnError(0, name, value);
  context.WriteOutput(artifact::kScores,
                      nlohmann::ordered_json{{"mean", mean}, {"views", per_view}}.dump(1) + "\n");
}

}  // namespace color3d
