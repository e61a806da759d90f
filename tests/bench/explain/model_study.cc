#include "tests/bench/explain/model_study.h"

#include <torch/types.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/error.h"
#include "core/base/progress.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/colorizer/model/padding.h"
#include "core/colorizer/training/recipe.h"
#include "core/colorizer/training/training_session.h"
#include "core/encoder/image_tensors.h"
#include "core/image/crop.h"
#include "core/image/guided_upsample.h"

namespace color3d {
namespace {

constexpr int kShownStridePx = 8;
constexpr uint64_t kSpreadSeed = 1;

torch::Tensor Padded(const Image& luminance) {
  return PadToMultiple(TensorFromImage(luminance), kPadMultiple);
}

// The part of a map that shows the picture, without padding.
Image WithoutPadding(const Image& map, int stride_px, const Image& picture) {
  const auto cells = [stride_px](int side) { return (side + stride_px - 1) / stride_px; };
  return Crop(map, 0, 0, cells(picture.width), cells(picture.height));
}

std::array<float, 2> MeanAb(const Image& ab) {
  std::array<float, 2> mean{};
  for (int c = 0; c < 2; ++c) {
    double sum = 0.0;
    for (size_t i = 0; i < ab.PlaneSize(); ++i) sum += ab.Plane(c)[i];
    mean[c] = static_cast<float>(sum / static_cast<double>(ab.PlaneSize()) / kAbScale);
  }
  return mean;
}

// The answer under the picture's L, Lab.
Image Colored(const PersonalModel& model, const torch::Tensor& answer, const Image& luminance) {
  const Image coarse = ImageFromTensor(answer);
  const Image fine = model.OutputStride() == 1
                         ? coarse
                         : UpsampleGuided(coarse, ImageFromTensor(Padded(luminance)));
  return JoinLab(luminance, Crop(fine, 0, 0, luminance.width, luminance.height));
}

torch::Tensor PatchOf(const Image& luminance, int left, int top, int side) {
  return TensorFromImage(Crop(luminance, left, top, side, side)) / 100.0;
}

bool Fits(const Image& picture, int left, int top, int side) {
  return left >= 0 && top >= 0 && left + side <= picture.width && top + side <= picture.height;
}

}  // namespace

std::unique_ptr<PersonalModel> StartModel(const TapEncoder& encoder,
                                          const TrainingPicture& key,
                                          const ColorizerOptions& options) {
  Random random(options.seed, /*stream=*/0);
  auto model =
      std::make_unique<PersonalModel>(encoder, RecipeFor(options).model, MeanAb(key.ab), random);
  model->set_half_products(false);
  model->FreezeStatistics(Padded(key.luminance));
  return model;
}

void TrainModel(const TrainingPicture& key, const ColorizerOptions& options, PersonalModel* model) {
  NullObserver progress;
  const std::vector<TrainingPicture> pictures = {key};
  model->RequireGradients(true);
  TrainingSession session(pictures, options, RecipeFor(options), *model);
  while (!session.Finished()) session.Step(progress, nullptr);
  session.KeepBetterParameters(progress);
  model->RequireGradients(false);
}

ModelStudies::ModelStudies(const ExplainScene& scene,
                           const TapEncoder& encoder,
                           const StudySizes& sizes)
    : scene_(scene), encoder_(encoder), sizes_(sizes) {
  CollectPatches();
}

void ModelStudies::CollectPatches() {
  const int side = sizes_.patch_px;
  const int per_pair =
      std::max(1, sizes_.points / std::max(1, static_cast<int>(scene_.pairs.size())));
  std::vector<torch::Tensor> first, second, warped;
  for (const ExplainPair& pair : scene_.pairs) {
    const Image& from = scene_.views[pair.first].luminance;
    const Image& to = scene_.views[pair.second].luminance;
    std::vector<const PixelMatch*> inside;
    for (const PixelMatch& match : pair.matches) {
      if (Fits(from, match.x - side / 2, match.y - side / 2, side) &&
          Fits(to,
               static_cast<int>(match.u) - side / 2,
               static_cast<int>(match.v) - side / 2,
               side)) {
        inside.push_back(&match);
      }
    }
    const size_t kept = std::min<size_t>(inside.size(), per_pair);
    for (size_t i = 0; i < kept; ++i) {
      const PixelMatch& match = *inside[i * inside.size() / kept];
      const int left = static_cast<int>(match.u) - side / 2;
      const int top = static_cast<int>(match.v) - side / 2;
      first.push_back(PatchOf(from, match.x - side / 2, match.y - side / 2, side));
      second.push_back(PatchOf(to, left, top, side));
      warped.push_back(PatchOf(pair.warped, left, top, side));
    }
  }
  if (first.empty()) {
    throw InvalidArgument(
        "no surface is shown by two views {} px from their borders; give larger pictures (--side)",
        side / 2);
  }
  patches_ = {torch::cat(first), torch::cat(second), torch::cat(warped)};
}

std::vector<int> ModelStudies::ScoredViews() const {
  std::vector<int> held_out, others;
  for (int i = 0; i < static_cast<int>(scene_.views.size()); ++i) {
    if (i == scene_.key) continue;
    (scene_.views[i].held_out ? held_out : others).push_back(i);
  }
  return held_out.empty() ? others : held_out;
}

double ModelStudies::GrayError() const {
  const std::vector<int> views = ScoredViews();
  double sum = 0.0;
  for (const int view : views) {
    const ExplainView& truth = scene_.views[view];
    sum += MeanDeltaE00(JoinLab(truth.luminance, Image(truth.lab.width, truth.lab.height, 2)),
                        truth.lab);
  }
  return sum / static_cast<double>(views.size());
}

void ModelStudies::MeasureFeatures(const PersonalModel& model, ModelStudy* study) const {
  const ConvNextConfig& config = encoder_.config();
  const int taps = config.StageCount();
  // By view: each tap, then the decoder's features, then the answers.
  std::vector<std::vector<FeatureMap>> maps;
  const std::vector<int> scored = ScoredViews();
  for (int i = 0; i < static_cast<int>(scene_.views.size()); ++i) {
    const ExplainView& view = scene_.views[i];
    const torch::Tensor luminance = Padded(view.luminance);
    const std::vector<torch::Tensor> values = model.Taps(luminance);
    std::vector<FeatureMap>& of_view = maps.emplace_back();
    for (int tap = 0; tap < taps; ++tap) {
      of_view.push_back({ImageFromTensor(values[tap]), static_cast<double>(config.Stride(tap))});
    }
    of_view.push_back({ImageFromTensor(model.Features(values, luminance)),
                       static_cast<double>(config.stem_stride)});
    const torch::Tensor answer = model.Decode(values, luminance) * kAbScale;
    of_view.push_back({ImageFromTensor(answer), static_cast<double>(model.OutputStride())});
    if (std::find(scored.begin(), scored.end(), i) == scored.end()) continue;
    study->delta_e00 += MeanDeltaE00(Colored(model, answer, view.luminance), view.lab) /
                        static_cast<double>(scored.size());
  }
  std::vector<FeatureDistance> distances;
  for (int kind = 0; kind < taps + 2; ++kind) {
    FeatureDistanceMeter meter;
    for (const ExplainPair& pair : scene_.pairs) {
      meter.Add(maps[pair.first][kind], maps[pair.second][kind], pair.matches);
    }
    distances.push_back(meter.Result());
  }
  study->color = distances.back();
  distances.pop_back();
  study->decoder = distances.back();
  distances.pop_back();
  study->taps = distances;
}

void ModelStudies::MeasureSpreads(const PersonalModel& model, ModelStudy* study) const {
  const auto answer = [&model](const torch::Tensor& luminance) {
    return model.Forward(luminance) * kAbScale;
  };
  const double others = static_cast<double>(scene_.views.size() - 1);
  for (int i = 0; i < static_cast<int>(scene_.views.size()); ++i) {
    const AnswerSpread spread =
        MeasureSpread(answer, Padded(scene_.views[i].luminance), sizes_.draws, kSpreadSeed);
    if (i == scene_.key) {
      study->key_spread = spread;
    } else {
      study->other_spread.variance += spread.variance / others;
      study->other_spread.chroma += spread.chroma / others;
      study->other_spread.places += spread.places / others;
    }
  }
}

ModelStudy ModelStudies::Measure(const std::string& name,
                                 double lambda,
                                 const PersonalModel& model) const {
  ModelStudy study;
  study.name = name;
  study.lambda = lambda;
  {
    torch::NoGradGuard no_grad;
    MeasureFeatures(model, &study);
    MeasureSpreads(model, &study);
  }
  const PatchColorizer colorizer(model, encoder_, sizes_.patch_px);
  const int64_t count = patches_.first.size(0);
  const int64_t chosen = std::min<int64_t>(sizes_.jacobians, count);
  std::vector<torch::Tensor> at;
  for (int64_t i = 0; i < chosen; ++i) {
    at.push_back(patches_.first.narrow(0, i * count / chosen, 1));
  }
  study.norms = MeasureNorms(colorizer, torch::cat(at), sizes_.iterations);
  study.bound = CompareWithBound(MeasurePoints(colorizer, patches_), study.norms);
  return study;
}

ViewMaps ModelStudies::Maps(int view, const PersonalModel& model) const {
  torch::NoGradGuard no_grad;
  const ConvNextConfig& config = encoder_.config();
  int stage = config.StageCount() - 1;
  while (stage > 0 && config.Stride(stage) > kShownStridePx) --stage;
  const Image& picture = scene_.views[view].luminance;
  const torch::Tensor luminance = Padded(picture);
  const std::vector<torch::Tensor> taps = model.Taps(luminance);
  ViewMaps maps;
  maps.tap = WithoutPadding(ImageFromTensor(taps[stage]), config.Stride(stage), picture);
  maps.decoder =
      WithoutPadding(ImageFromTensor(model.Features(taps, luminance)), config.stem_stride, picture);
  maps.colored = SrgbFromLab(Colored(model, model.Decode(taps, luminance) * kAbScale, picture));
  return maps;
}

}  // namespace color3d
