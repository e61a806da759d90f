#include "core/colorizer/personal/personal_colorizer.h"

#include <torch/types.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/bytes/byte_source.h"
#include "core/base/error.h"
#include "core/colorizer/model/named_tensors.h"
#include "core/colorizer/model/padding.h"
#include "core/colorizer/personal/personal_corrector.h"
#include "core/colorizer/training/options_json.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/torch_errors.h"
#include "core/encoder/torch_threads.h"
#include "core/image/codec.h"
#include "core/image/crop.h"
#include "core/image/fill_holes.h"
#include "core/image/guided_upsample.h"
#include "core/image/image_checks.h"

namespace color3d {
namespace {

constexpr char kWhat[] = "the colorizer file";
constexpr char kModel[] = "model.";  // prefix of the network's arrays
constexpr double kMaxAb = 128.0;     // Lab units; sRGB spans about -108..98

Image FitTo(const Image& image, int width, int height) {
  return image.Empty() ? Image() : Resize(image, width, height);
}

}  // namespace

PersonalColorizer::PersonalColorizer(Parts parts)
    : parts_(std::move(parts)), recipe_(RecipeFor(parts_.options)) {
  const double trained =
      parts_.curve.empty() ? 0.0 : static_cast<double>(parts_.curve.back().iteration);
  if (parts_.decodes) trust_ = 1.0 - std::exp(-trained / recipe_.trust_iterations);
  torch::NoGradGuard no_grad;
  parts_.model->RequireGradients(false);
  parts_.model->set_half_products(false);
  for (auto& [name, tensor] : parts_.model->parameters()) {
    torch::Tensor target = tensor;
    target.copy_(tensor.to(torch::kHalf).to(torch::kFloat32));
  }
}

// Share of the decoder in the blend, [1,1,H/s,W/s]: large where the neighbors disagree.
torch::Tensor PersonalColorizer::DecoderShare(const torch::Tensor& neighbor_variance,
                                              const torch::Tensor& decoded) const {
  const torch::Tensor share = color3d::DecoderShare(recipe_, trust_, neighbor_variance);
  return torch::upsample_bilinear2d(share.unsqueeze(0).unsqueeze(0),
                                    {decoded.size(2), decoded.size(3)},
                                    /*align_corners=*/false);
}

// `taps`: the adapted ones, if the model has adapters.
PersonalColorizer::Answer PersonalColorizer::Blend(std::vector<torch::Tensor> taps,
                                                   const torch::Tensor& luminance,
                                                   const torch::Tensor& wanted,
                                                   const Image& position) const {
  const bool decode = !parts_.neighbors || trust_ > 0.0;
  const PersonalModel& model = *parts_.model;
  torch::Tensor decoded;
  if (decode) {
    decoded = model.Decode(taps, luminance) * kAbScale;
    // A barely trained decoder is arbitrary where a picture resembles nothing in the key view.
    decoded = decoded.clamp(-kMaxAb, kMaxAb);
  }
  if (!parts_.neighbors) return {decoded, {}};
  if (model.config().HasAdapters()) taps = parts_.encoder->Taps(parts_.encoder->Input(luminance));
  const NeighborColors found = parts_.neighbors->Lookup(taps, luminance, wanted, position);
  Image cells = ImageFromTensor(found.ab);
  if (wanted.defined()) FillHoles(ImageFromTensor(wanted.to(torch::kFloat32).unsqueeze(0)), &cells);
  if (parts_.head) {
    const NeighborColors filled{TensorFromImage(cells).squeeze(0), found.distance, found.variance};
    cells = ImageFromTensor(parts_.head->Refine(taps, luminance, filled));
  }
  const int stride = model.OutputStride();
  const torch::Tensor guide = torch::avg_pool2d(luminance, {stride, stride});
  const Image coarse_luminance = ImageFromTensor(guide);
  const torch::Tensor near = TensorFromImage(FromRelative(
      parts_.relative_chroma, coarse_luminance, UpsampleGuided(cells, coarse_luminance)));
  if (!decode) return {near, found.distance};
  return {torch::lerp(near, decoded, DecoderShare(found.variance, decoded)), found.distance};
}

void PersonalColorizer::Check(const Image& luminance) {
  RequireLuminance(luminance, "the colorizer");
  if (!IsFinite(luminance)) {
    throw InvalidArgument("the luminance to colour has a value that is not finite");
  }
}

std::pair<int, int> PersonalColorizer::PaddedSize(const Image& small) {
  const auto padded = [](int side) {
    return (side + kPadMultiple - 1) / kPadMultiple * kPadMultiple;
  };
  return {padded(small.width), padded(small.height)};
}

torch::Tensor PersonalColorizer::Padded(const Image& small) {
  return PadToMultiple(TensorFromImage(small), kPadMultiple);
}

void PersonalColorizer::SetThreads() const { SetTorchThreads(parts_.threads); }

Image PersonalColorizer::AtInferenceSize(const Image& luminance) const {
  return parts_.full_size ? luminance : FitWithin(luminance, parts_.options.max_side_px);
}

ColorPrediction PersonalColorizer::PredictFromTaps(const std::vector<torch::Tensor>& taps,
                                                   const torch::Tensor& padded,
                                                   const Image& small,
                                                   const Image& luminance,
                                                   const PictureFacts& facts) const {
  const Answer answer = Blend(taps,
                              padded,
                              WantedCells(facts.known, small),
                              FitTo(facts.position, small.width, small.height));
  const Image coarse_ab = ImageFromTensor(answer.ab);
  const bool is_fine = parts_.model->OutputStride() == 1;
  const Image fine = is_fine ? coarse_ab : UpsampleGuided(coarse_ab, ImageFromTensor(padded));
  ColorPrediction prediction;
  prediction.ab = Crop(fine, 0, 0, small.width, small.height);
  if (answer.distance.defined()) {
    const Image coarse = ImageFromTensor(answer.distance.unsqueeze(0));
    prediction.distance =
        Crop(Resize(coarse, fine.width, fine.height), 0, 0, small.width, small.height);
  }
  if (small.width == luminance.width && small.height == luminance.height) return prediction;
  prediction.ab = UpsampleGuided(prediction.ab, luminance);
  if (!prediction.distance.Empty()) {
    prediction.distance = Resize(prediction.distance, luminance.width, luminance.height);
  }
  return prediction;
}

torch::Tensor PersonalColorizer::WantedCells(const Image& known, const Image& small) const {
  if (known.Empty() || !parts_.neighbors) return {};
  Image unknown = Resize(known, small.width, small.height);
  for (float& value : unknown.data) value = value > 0.999f ? 0.0f : 1.0f;
  const torch::Tensor cells =
      torch::max_pool2d(Padded(unknown), {kCellPx, kCellPx}, {kCellPx, kCellPx});
  constexpr int kMarginCells = 1;  // reach of a cell in upsampling
  return torch::max_pool2d(cells,
                           {2 * kMarginCells + 1, 2 * kMarginCells + 1},
                           {1, 1},
                           {kMarginCells, kMarginCells})[0][0] > 0.5;
}

Image PersonalColorizer::Colorize(const Image& luminance) const { return Predict(luminance).ab; }

ColorPrediction PersonalColorizer::Predict(const Image& luminance,
                                           const PictureFacts& facts) const {
  Check(luminance);
  return WithTorchErrors("colorizer", [&] {
    torch::NoGradGuard no_grad;
    SetThreads();
    const Image small = AtInferenceSize(luminance);
    const torch::Tensor padded = Padded(small);
    return PredictFromTaps(parts_.model->Taps(padded), padded, small, luminance, facts);
  });
}

std::unique_ptr<const Corrector> PersonalColorizer::Correct(
    std::span<const Correction> corrections) const {
  if (!parts_.neighbors) {
    throw Error(
        ErrorCode::kFailedPrecondition,
        "colorizers of the paper's recipe cannot be corrected; colour the scene with another "
        "preset");
  }
  for (const Correction& correction : corrections) Check(correction.picture.luminance);
  return WithTorchErrors("correction", [&]() -> std::unique_ptr<const Corrector> {
    SetThreads();
    return std::make_unique<PersonalCorrector>(*parts_.encoder,
                                               *parts_.neighbors,
                                               parts_.relative_chroma,
                                               parts_.options.max_side_px,
                                               parts_.threads,
                                               corrections);
  });
}

std::string PersonalColorizer::Serialize() const {
  return WithTorchErrors("colorizer", [&] {
    TensorFile file;
    file.facts = {{"encoder", parts_.encoder->digest()},
                  {"options", JsonFromOptions(parts_.options)},
                  {"neighbors", parts_.neighbors != nullptr},
                  {"relative_chroma", parts_.relative_chroma.power},
                  {"curve", JsonFromCurve(parts_.curve)}};
    PutTensors(parts_.model->parameters(), kModel, StoredType::kFloat16, &file);
    PutTensors(parts_.model->statistics(), kModel, StoredType::kFloat32, &file);
    if (parts_.neighbors) parts_.neighbors->PutInto(&file);
    return WriteTensorFile(file, kColorizerFormat);
  });
}

std::shared_ptr<const Colorizer> PersonalColorizer::Deserialize(
    std::string_view bytes,
    std::shared_ptr<const TapEncoder> encoder,
    int threads,
    const PredictionOptions& use) {
  TensorFile file = ReadTensorFile(bytes, kColorizerFormat, kWhat);
  Parts parts;
  bool has_neighbors = false;
  try {
    const std::string trained_on = file.facts.at("encoder");
    if (trained_on != encoder->digest()) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "the colorizer was trained on encoder {}, but this server has {}; train it again",
                  trained_on,
                  encoder->digest());
    }
    parts.options = OptionsFromJson(file.facts.at("options"));
    has_neighbors = file.facts.at("neighbors");
    parts.relative_chroma.power = file.facts.at("relative_chroma");
    parts.curve = CurveFromJson(file.facts.at("curve"));
  } catch (const nlohmann::json::exception& error) {
    throw InvalidArgument("{} has a damaged header: {}", kWhat, error.what());
  }
  parts.options.Validate();
  parts.encoder = encoder;
  parts.threads = threads;
  const TrainingRecipe recipe = RecipeFor(parts.options);
  Random random(0);
  parts.model = std::make_unique<PersonalModel>(
      *encoder, recipe.model, std::array<float, 2>{0.0f, 0.0f}, random);
  TakeTensors(parts.model->parameters(), kModel, kWhat, &file);
  TakeTensors(parts.model->statistics(), kModel, kWhat, &file);
  if (has_neighbors) {
    parts.neighbors = FeatureNeighbors::TakeFrom(*encoder, recipe.neighbor_options, kWhat, &file);
  }
  if (recipe.exemplar_head) parts.head = ExemplarHead::Embedded(*encoder);
  if (!file.arrays.empty()) {
    throw InvalidArgument(
        "{} has an unknown array {}", kWhat, QuotedName(file.arrays.begin()->first));
  }
  if (use.parts == ColorizerParts::kDecoder) parts.neighbors.reset();
  parts.decodes = use.parts != ColorizerParts::kNeighbors;
  parts.full_size = use.full_size;
  if (!parts.decodes && !has_neighbors) {
    throw Error(ErrorCode::kFailedPrecondition,
                "the colorizer was trained without nearest neighbours; train another one");
  }
  return std::make_shared<const PersonalColorizer>(std::move(parts));
}

}  // namespace color3d
