#include "core/colorizer/personal_colorizer.h"

#include <torch/torch.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/error.h"
#include "core/colorizer/padding.h"
#include "core/colorizer/tensor_archive.h"
#include "core/encoder/threads.h"
#include "core/encoder/torch_errors.h"
#include "core/image/codec.h"
#include "core/image/guided_upsample.h"

namespace color3d {
namespace {

using Json = nlohmann::json;

constexpr char kMagic[] = "C3DCOLR1";
constexpr uint32_t kVersion = 2;  // 2: weights of the neighbours
constexpr char kWhat[] = "the colorizer file";
// Guided upsampling: windows of 5x5 cells; contrasts of L below about 4 units are no edges.
constexpr int kGuideRadius = 2;
constexpr float kGuideVarianceFloor = 20.0f;
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

Json JsonFromOptions(const ColorizerOptions& options) {
  return {{"recipe", options.recipe == ColorizerOptions::Recipe::kPaper ? "paper" : "ours"},
          {"iterations", options.iterations},
          {"time_limit_seconds", options.time_limit_seconds},
          {"max_side_px", options.max_side_px},
          {"crop_px", options.crop_px},
          {"consistency_weight", options.consistency_weight},
          {"seed", options.seed}};
}

ColorizerOptions OptionsFromJson(const Json& json) {
  ColorizerOptions options;
  const std::string recipe = json.at("recipe");
  if (recipe != "ours" && recipe != "paper") {
    throw InvalidArgument(std::string(kWhat) + " names the unknown recipe \"" + recipe + "\"");
  }
  options.recipe =
      recipe == "paper" ? ColorizerOptions::Recipe::kPaper : ColorizerOptions::Recipe::kOurs;
  options.iterations = json.at("iterations");
  options.time_limit_seconds = json.at("time_limit_seconds");
  options.max_side_px = json.at("max_side_px");
  options.crop_px = json.at("crop_px");
  options.consistency_weight = json.at("consistency_weight");
  options.seed = json.at("seed");
  return options;
}

}  // namespace

PersonalColorizer::PersonalColorizer(Parts parts)
    : parts_(std::move(parts)), recipe_(RecipeFor(parts_.options)) {
  const double trained =
      parts_.curve.empty() ? 0.0 : static_cast<double>(parts_.curve.back().iteration);
  neighbour_share_ = recipe_.neighbour_share + (1.0 - recipe_.neighbour_share) *
                                                   std::exp(-trained / recipe_.trust_iterations);
  torch::NoGradGuard no_grad;
  parts_.model->RequireGradients(false);
  for (auto& [name, tensor] : parts_.model->parameters()) {
    torch::Tensor target = tensor;
    target.copy_(tensor.to(torch::kHalf).to(torch::kFloat32));
  }
}

PersonalColorizer::Answer PersonalColorizer::Ask(const torch::Tensor& luminance,
                                                 int picture_height) const {
  const bool decode = !parts_.neighbours || neighbour_share_ < 1.0;
  const PersonalModel& model = *parts_.model;
  std::vector<torch::Tensor> taps;
  torch::Tensor decoded;
  if (decode) {
    taps = model.Taps(luminance);
    decoded = model.Decode(taps, luminance) * kAbScale;
    if (recipe_.flip_average) {
      decoded = 0.5 * (decoded + kAbScale * model.Forward(luminance.flip({3})).flip({3}));
    }
  }
  // A hardly trained decoder may answer anything where a picture has nothing of the key view's.
  if (decode) decoded = decoded.clamp(-kMaxAb, kMaxAb);
  if (!parts_.neighbours) return {decoded, {}};
  if (!decode || model.config().adapters) {
    taps = parts_.encoder->Taps(parts_.encoder->Input(luminance));
  }
  const NeighbourColors found = parts_.neighbours->Lookup(taps, luminance, picture_height);
  const int stride = model.OutputStride();
  const torch::Tensor guide = torch::avg_pool2d(luminance, {stride, stride});
  const torch::Tensor near = TensorFromImage(UpsampleGuided(
      ImageFromTensor(found.ab), ImageFromTensor(guide), kGuideRadius, kGuideVarianceFloor));
  if (!decode) return {near, found.distance};
  return {torch::lerp(decoded, near, neighbour_share_), found.distance};
}

ColorPrediction PersonalColorizer::PredictAtTrainingSize(const Image& luminance) const {
  const torch::Tensor padded = PadToMultiple(TensorFromImage(luminance), kPadMultiple);
  const Answer answer = Ask(padded, luminance.height);
  ColorPrediction prediction;
  const Image fine = UpsampleGuided(
      ImageFromTensor(answer.ab), ImageFromTensor(padded), kGuideRadius, kGuideVarianceFloor);
  prediction.ab = CropTo(fine, luminance.width, luminance.height);
  if (answer.distance.defined()) {
    const Image coarse = ImageFromTensor(answer.distance.unsqueeze(0));
    prediction.distance =
        CropTo(Resize(coarse, fine.width, fine.height), luminance.width, luminance.height);
  }
  return prediction;
}

Image PersonalColorizer::Colorize(const Image& luminance) const { return Predict(luminance).ab; }

ColorPrediction PersonalColorizer::Predict(const Image& luminance) const {
  if (luminance.channels != 1 || luminance.Empty()) {
    throw InvalidArgument("the colorizer takes a picture with 1 channel (L), this one has " +
                          std::to_string(luminance.channels));
  }
  for (float value : luminance.data) {
    if (!std::isfinite(value)) {
      throw InvalidArgument("the luminance to be coloured holds a value that is not finite");
    }
  }
  return WithTorchErrors("colorizer", [&] {
    torch::NoGradGuard no_grad;
    SetTorchThreads(parts_.options.threads);
    const Image small = FitWithin(luminance, parts_.options.max_side_px);
    ColorPrediction prediction = PredictAtTrainingSize(small);
    if (small.width == luminance.width && small.height == luminance.height) return prediction;
    prediction.ab = UpsampleGuided(prediction.ab, luminance, kGuideRadius, kGuideVarianceFloor);
    if (!prediction.distance.Empty()) {
      prediction.distance = Resize(prediction.distance, luminance.width, luminance.height);
    }
    return prediction;
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
