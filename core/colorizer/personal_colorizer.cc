#include "core/colorizer/personal_colorizer.h"

#include <torch/torch.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/error.h"
#include "core/colorizer/options_json.h"
#include "core/colorizer/padding.h"
#include "core/colorizer/tensor_archive.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/torch_errors.h"
#include "core/encoder/torch_threads.h"
#include "core/image/codec.h"
#include "core/image/guided_upsample.h"

namespace color3d {
namespace {

using Json = nlohmann::json;

constexpr char kMagic[] = "C3DCOLR1";
constexpr uint32_t kVersion = 3;  // 3: weights of the neighbours
constexpr char kWhat[] = "the colorizer file";
constexpr double kMaxAb = 128.0;  // Lab units; sRGB spans about -108..98

Image CropTo(const Image& image, int width, int height) {
  Image out(width, height, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) out.At(c, y, x) = image.At(c, y, x);
    }
  }
  return out;
}

}  // namespace

PersonalColorizer::PersonalColorizer(Parts parts)
    : parts_(std::move(parts)), recipe_(RecipeFor(parts_.options)) {
  const double trained =
      parts_.curve.empty() ? 0.0 : static_cast<double>(parts_.curve.back().iteration);
  trust_ = 1.0 - std::exp(-trained / recipe_.trust_iterations);
  torch::NoGradGuard no_grad;
  parts_.model->RequireGradients(false);
  parts_.model->set_half_products(false);
  for (auto& [name, tensor] : parts_.model->parameters()) {
    torch::Tensor target = tensor;
    target.copy_(tensor.to(torch::kHalf).to(torch::kFloat32));
  }
}

// Of the blend, [1,1,H/s,W/s]: large where the neighbours contradict each other.
torch::Tensor PersonalColorizer::DecoderShare(const torch::Tensor& neighbour_variance,
                                              const torch::Tensor& decoded) const {
  const double doubt = recipe_.neighbour_doubt * recipe_.neighbour_doubt;
  const torch::Tensor share = trust_ * neighbour_variance / (doubt + neighbour_variance);
  return torch::upsample_bilinear2d(share.unsqueeze(0).unsqueeze(0),
                                    {decoded.size(2), decoded.size(3)},
                                    /*align_corners=*/false);
}

// `taps`: with adapters the adapted ones.
PersonalColorizer::Answer PersonalColorizer::Ask(std::vector<torch::Tensor> taps,
                                                 const torch::Tensor& luminance,
                                                 int picture_height,
                                                 const torch::Tensor& wanted) const {
  const bool decode = !parts_.neighbours || trust_ > 0.0;
  const PersonalModel& model = *parts_.model;
  torch::Tensor decoded;
  if (decode) {
    decoded = model.Decode(taps, luminance) * kAbScale;
    if (recipe_.flip_average) {
      decoded = 0.5 * (decoded + kAbScale * model.Forward(luminance.flip({3})).flip({3}));
    }
    // A hardly trained decoder may answer anything where a picture has nothing of the key view's.
    decoded = decoded.clamp(-kMaxAb, kMaxAb);
  }
  if (!parts_.neighbours) return {decoded, {}};
  if (model.config().HasAdapters()) taps = parts_.encoder->Taps(parts_.encoder->Input(luminance));
  const NeighbourColors found = parts_.neighbours->Lookup(taps, luminance, picture_height, wanted);
  const int stride = model.OutputStride();
  const torch::Tensor guide = torch::avg_pool2d(luminance, {stride, stride});
  const torch::Tensor near =
      TensorFromImage(UpsampleGuided(ImageFromTensor(found.ab), ImageFromTensor(guide)));
  if (!decode) return {near, found.distance};
  return {torch::lerp(near, decoded, DecoderShare(found.variance, decoded)), found.distance};
}

void PersonalColorizer::Check(const Image& luminance) {
  if (luminance.channels != 1 || luminance.Empty()) {
    throw InvalidArgument("the colorizer takes a picture with 1 channel (L), this one has " +
                          std::to_string(luminance.channels));
  }
  for (float value : luminance.data) {
    if (!std::isfinite(value)) {
      throw InvalidArgument("the luminance to be coloured holds a value that is not finite");
    }
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

void PersonalColorizer::SetThreads() const { SetTorchThreads(parts_.options.threads); }

Image PersonalColorizer::AtTrainingSize(const Image& luminance) const {
  return FitWithin(luminance, parts_.options.max_side_px);
}

ColorPrediction PersonalColorizer::PredictFromTaps(const std::vector<torch::Tensor>& taps,
                                                   const torch::Tensor& padded,
                                                   const Image& small,
                                                   const Image& luminance,
                                                   const Image& known) const {
  const Answer answer = Ask(taps, padded, small.height, WantedCells(known, small));
  const Image fine = UpsampleGuided(ImageFromTensor(answer.ab), ImageFromTensor(padded));
  ColorPrediction prediction;
  prediction.ab = CropTo(fine, small.width, small.height);
  if (answer.distance.defined()) {
    const Image coarse = ImageFromTensor(answer.distance.unsqueeze(0));
    prediction.distance =
        CropTo(Resize(coarse, fine.width, fine.height), small.width, small.height);
  }
  if (small.width == luminance.width && small.height == luminance.height) return prediction;
  prediction.ab = UpsampleGuided(prediction.ab, luminance);
  if (!prediction.distance.Empty()) {
    prediction.distance = Resize(prediction.distance, luminance.width, luminance.height);
  }
  return prediction;
}

torch::Tensor PersonalColorizer::WantedCells(const Image& known, const Image& small) const {
  if (known.Empty() || !parts_.neighbours) return {};
  Image unknown = Resize(known, small.width, small.height);
  for (float& value : unknown.data) value = value > 0.999f ? 0.0f : 1.0f;
  const int stride = recipe_.neighbour_options.stride;
  const torch::Tensor cells =
      torch::max_pool2d(Padded(unknown), {stride, stride}, {stride, stride});
  constexpr int kMarginCells = 5;  // guided upsampling averages twice over windows of 5 cells
  return torch::max_pool2d(cells,
                           {2 * kMarginCells + 1, 2 * kMarginCells + 1},
                           {1, 1},
                           {kMarginCells, kMarginCells})[0][0] > 0.5;
}

Image PersonalColorizer::Colorize(const Image& luminance) const { return Predict(luminance).ab; }

ColorPrediction PersonalColorizer::Predict(const Image& luminance, const Image& known) const {
  Check(luminance);
  return WithTorchErrors("colorizer", [&] {
    torch::NoGradGuard no_grad;
    SetThreads();
    const Image small = AtTrainingSize(luminance);
    const torch::Tensor padded = Padded(small);
    return PredictFromTaps(parts_.model->Taps(padded), padded, small, luminance, known);
  });
}

std::string PersonalColorizer::Serialize() const {
  return WithTorchErrors("colorizer", [&] {
    Json header{{"encoder", parts_.encoder->digest()},
                {"options", JsonFromOptions(parts_.options)},
                {"neighbours", parts_.neighbours != nullptr},
                {"curve", Json::array()}};
    for (const TrainingPoint& point : parts_.curve) {
      header["curve"].push_back(
          {point.iteration, point.seconds, point.train_l1_ab, point.validation_delta_e00});
    }
    Archive archive;
    archive.version = kVersion;
    archive.header = header.dump();
    PutTensors(parts_.model->parameters(), "model.", ArchiveArray::Type::kFloat16, archive);
    PutTensors(parts_.model->statistics(), "model.", ArchiveArray::Type::kFloat32, archive);
    if (parts_.neighbours) {
      for (const auto& [name, tensor] : parts_.neighbours->State()) {
        archive.arrays["neighbours." + name] =
            ArrayFromTensor(tensor,
                            FeatureNeighbours::IsStoredAsHalf(name) ? ArchiveArray::Type::kFloat16
                                                                    : ArchiveArray::Type::kFloat32);
      }
    }
    return WriteArchive(archive, kMagic);
  });
}

std::shared_ptr<const Colorizer> PersonalColorizer::Deserialize(
    std::string_view bytes, std::shared_ptr<const TapEncoder> encoder, int threads) {
  Archive archive = ReadArchive(bytes, kMagic, kVersion, kWhat);
  Parts parts;
  bool has_neighbours = false;
  try {
    const Json header = Json::parse(archive.header);
    const std::string trained_on = header.at("encoder");
    if (trained_on != encoder->digest()) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "the colorizer was trained on the encoder " + trained_on + ", this server has " +
                      encoder->digest() + "; train it again");
    }
    parts.options = OptionsFromJson(header.at("options"));
    has_neighbours = header.at("neighbours");
    for (const Json& point : header.at("curve")) {
      parts.curve.push_back({point.at(0), point.at(1), point.at(2), point.at(3)});
    }
  } catch (const Json::exception& error) {
    throw InvalidArgument(std::string(kWhat) + " has a damaged header: " + error.what());
  }
  parts.options.threads = threads;
  parts.options.Validate();
  parts.encoder = encoder;
  const TrainingRecipe recipe = RecipeFor(parts.options);
  Random random(0);
  parts.model = std::make_unique<PersonalModel>(
      *encoder, recipe.model, std::array<float, 2>{0.0f, 0.0f}, random);
  TakeTensors(parts.model->parameters(), "model.", kWhat, archive);
  TakeTensors(parts.model->statistics(), "model.", kWhat, archive);
  if (has_neighbours) {
    parts.neighbours =
        FeatureNeighbours::FromArchive(*encoder, recipe.neighbour_options, kWhat, archive);
  }
  if (!archive.arrays.empty()) {
    throw InvalidArgument(std::string(kWhat) + " holds the unknown array \"" +
                          archive.arrays.begin()->first + "\"");
  }
  return std::make_shared<const PersonalColorizer>(std::move(parts));
}

}  // namespace color3d
