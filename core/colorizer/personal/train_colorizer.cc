#include "core/colorizer/personal/train_colorizer.h"

#include <fmt/format.h>
#include <torch/types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "core/base/error.h"
#include "core/colorizer/model/padding.h"
#include "core/colorizer/neighbors/feature_neighbors.h"
#include "core/colorizer/personal/personal_colorizer.h"
#include "core/colorizer/training/recipe.h"
#include "core/colorizer/training/training_session.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/torch_errors.h"
#include "core/encoder/torch_threads.h"
#include "core/image/codec.h"
#include "core/image/image_checks.h"
#include "core/image/weighted_resize.h"

namespace color3d {
namespace {

constexpr float kMaxGivenAb = 256.0f;
// Iterations per turn: enough to make the cost of handing over negligible.
constexpr int kStepsPerTurn = 5;

void CheckPicture(const TrainingPicture& picture) {
  const std::string& name = picture.name;
  const int width = picture.luminance.width, height = picture.luminance.height;
  const auto check = [&](const Image& map, const char* what, int channels) {
    if (map.width != width || map.height != height || map.channels != channels) {
      throw InvalidArgument("the {} of {} is {}x{} px with {} channels, expected {}x{} with {}",
                            what,
                            name,
                            map.width,
                            map.height,
                            map.channels,
                            width,
                            height,
                            channels);
    }
    if (!IsFinite(map)) throw InvalidArgument("{} has a value that is not finite", name);
  };
  if (picture.luminance.Empty()) throw InvalidArgument("{} is empty", name);
  check(picture.luminance, "L", 1);
  check(picture.ab, "ab", 2);
  if (!picture.weight.Empty()) check(picture.weight, "weight", 1);
  if (!picture.position.Empty()) check(picture.position, "position", 4);
  for (float value : picture.ab.data) {
    // Far beyond any colour. Values stored in half precision would overflow.
    if (std::abs(value) > kMaxGivenAb) {
      throw InvalidArgument(
          "{} has a chroma of {} Lab units; the maximum is {}", name, value, kMaxGivenAb);
    }
  }
  for (float value : picture.weight.data) {
    if (value < 0.0f || value > 1.0f) {
      throw InvalidArgument("the weights of {} contain {}, which is outside 0..1", name, value);
    }
  }
  if (!(picture.share >= 0.0 && picture.share <= 1e6)) {
    throw InvalidArgument("the share of {} is {}, which is outside 0..1e6", name, picture.share);
  }
}

void CheckPictures(const std::vector<TrainingPicture>& pictures) {
  if (pictures.empty()) throw InvalidArgument("there is no picture to train on");
  double shares = 0.0;
  for (const TrainingPicture& picture : pictures) {
    CheckPicture(picture);
    shares += picture.share;
  }
  if (!(shares > 0.0)) {
    throw InvalidArgument("the shares of all training pictures are 0; give one a positive share");
  }
}

void FitWithin(int max_side_px, TrainingPicture* picture) {
  picture->luminance = FitWithin(picture->luminance, max_side_px);
  const int width = picture->luminance.width, height = picture->luminance.height;
  if (!picture->position.Empty()) picture->position = Resize(picture->position, width, height);
  if (picture->weight.Empty()) {
    picture->ab = Resize(picture->ab, width, height);
    return;
  }
  picture->ab = ResizeWeighted(picture->ab, picture->weight, width, height);
  picture->weight = Resize(picture->weight, width, height);
}

std::shared_ptr<const TapEncoder> RequireTaps(const std::shared_ptr<const Encoder>& encoder) {
  auto network = std::dynamic_pointer_cast<const TapEncoder>(encoder);
  if (!network) {
    throw Error(ErrorCode::kFailedPrecondition,
                "the colorizer needs an encoder with feature maps (a ConvNeXt), but got {}",
                encoder ? encoder->description() : "null");
  }
  return network;
}

// Pictures are padded to kPadMultiple.
void CheckTaps(const ConvNextConfig& encoder) {
  const int last_stride = encoder.Stride(encoder.StageCount() - 1);
  if (kPadMultiple % last_stride == 0) return;
  throw Error(ErrorCode::kFailedPrecondition,
              "the colorizer supports encoders with strides up to {}, but this one has {}",
              kPadMultiple,
              last_stride);
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

// Start of training: neighbors, and the model with the key view's statistics.
PersonalColorizer::Parts Prepare(std::shared_ptr<const TapEncoder> encoder,
                                 const std::vector<TrainingPicture>& pictures,
                                 const ColorizerOptions& options,
                                 const TrainingRecipe& recipe,
                                 const CancellationToken& cancel,
                                 ThreadPool* helpers) {
  PersonalColorizer::Parts parts;
  parts.encoder = std::move(encoder);
  parts.options = options;
  const TrainingPicture& key = pictures.front();
  SetTorchThreads(1);
  if (recipe.neighbors) {
    parts.relative_chroma = FitRelativeChroma(key.luminance, key.ab);
    FeatureNeighborsOptions neighbors = recipe.neighbor_options;
    neighbors.relative_chroma = parts.relative_chroma;
    parts.neighbors = std::make_unique<FeatureNeighbors>(
        *parts.encoder, pictures, neighbors, Random(options.seed, /*stream=*/3), cancel, helpers);
  }
  if (recipe.exemplar_head) parts.head = ExemplarHead::Embedded(*parts.encoder);
  Random start(options.seed, /*stream=*/0);
  parts.model =
      std::make_unique<PersonalModel>(*parts.encoder, recipe.model, MeanAb(key.ab), start);
  parts.model->FreezeStatistics(PadToMultiple(TensorFromImage(key.luminance), kPadMultiple));
  parts.model->RequireGradients(true);
  return parts;
}

// Returns false if the neighbours agree so well that a trained decoder would have less than
// min_decoder_share of the answers. It is expected to have the mean of the share that it would have
// in cells without a colour. Without such cells that share is unknown, and it is trained.
bool DecoderPays(const PersonalColorizer::Parts& parts,
                 const TrainingRecipe& recipe,
                 ProgressObserver& progress) {
  const ColorizerOptions& options = parts.options;
  if (options.min_decoder_share == 0.0 || !parts.neighbors) return true;
  const torch::Tensor& variance = parts.neighbors->open_variance();
  if (variance.size(0) == 0) return options.min_decoder_share < 1.0;
  const double trust = 1.0 - std::exp(-options.iterations / recipe.trust_iterations);
  const double share = DecoderShare(recipe, trust, variance).mean().item<double>();
  progress.OnError(options.iterations, kDecoderShareName, share);
  return share >= options.min_decoder_share;
}

// CIEDE2000 of an untrained decoder and of the neighbours on held-out crops of the key view.
void ReportNeighborErrors(const TrainingSession& session,
                          const PersonalColorizer& colorizer,
                          int stride,
                          ProgressObserver& progress) {
  progress.OnError(0, "validation_delta_e00", session.HeldOutError());
  const double error = session.HeldOutError([&](const TrainingSample& sample) {
    const Image ab = colorizer.Colorize(ImageFromTensor(sample.luminance));
    return torch::avg_pool2d(TensorFromImage(ab), {stride, stride}) / kAbScale;
  });
  progress.OnError(0, "validation_delta_e00", error);
}

void Train(TrainingSession& session,
           const RunControl& control,
           SceneBatch::Membership& membership) {
  while (!session.Finished()) {
    control.cancel.ThrowIfCancelled();
    {
      const SceneBatch::Turn turn(membership, control.cancel);
      for (int i = 0; i < kStepsPerTurn && !session.Finished(); ++i) {
        control.cancel.ThrowIfCancelled();
        session.Step(control.progress, turn.slots() > 1 ? &control.pool : nullptr);
      }
    }
    if (session.AtCheckpoint() && control.checkpoints.WantsSave()) {
      control.checkpoints.Save(session.Checkpoint());
    }
  }
}

}  // namespace

std::shared_ptr<const Colorizer> TrainColorizer(std::shared_ptr<const Encoder> encoder,
                                                std::vector<TrainingPicture> pictures,
                                                const ColorizerOptions& given_options,
                                                const RunControl& control,
                                                const std::optional<BatchPlace>& place) {
  given_options.Validate();
  ColorizerOptions options = given_options;
  if (RecipeFor(options).exemplar_head) options.iterations = 0;
  CheckPictures(pictures);
  auto taps = RequireTaps(encoder);
  CheckTaps(taps->config());
  const TrainingRecipe recipe = RecipeFor(options);
  return WithTorchErrors("personalization", [&]() -> std::shared_ptr<const Colorizer> {
    SceneBatch alone(control.pool.thread_count());
    SceneBatch::Membership membership(place ? place->batch : alone, place ? place->project : "");
    std::optional<SceneBatch::Turn> turn(std::in_place, membership, control.cancel);
    for (TrainingPicture& picture : pictures) {
      FitWithin(options.max_side_px, &picture);
      if (options.equal_draws) picture.share = 1.0;
    }
    ThreadPool* helpers = turn->slots() > 1 ? &control.pool : nullptr;
    auto parts = Prepare(std::move(taps), pictures, options, recipe, control.cancel, helpers);
    const bool trains = options.iterations > 0 && DecoderPays(parts, recipe, control.progress);
    if (!trains) options.iterations = 0;
    options.min_decoder_share = 0.0;  // decided
    parts.options = options;
    TrainingSession session(pictures, options, recipe, *parts.model);
    session.Resume(control.checkpoints.Load(), control.progress);
    turn.reset();
    Train(session, control, membership);
    turn.emplace(membership, control.cancel);
    session.KeepBetterParameters(control.progress);
    parts.curve = session.curve();
    parts.threads = control.pool.thread_count();
    const int stride = parts.model->OutputStride();
    auto colorizer = std::make_shared<const PersonalColorizer>(std::move(parts));
    if (!trains) ReportNeighborErrors(session, *colorizer, stride, control.progress);
    return colorizer;
  });
}

std::shared_ptr<const Colorizer> LoadColorizer(std::string_view bytes,
                                               std::shared_ptr<const Encoder> encoder,
                                               int threads,
                                               const PredictionOptions& options) {
  return WithTorchErrors("colorizer file", [&] {
    return PersonalColorizer::Deserialize(bytes, RequireTaps(encoder), threads, options);
  });
}

std::string ColorizerForOtherScene(std::string_view bytes, std::shared_ptr<const Encoder> encoder) {
  LoadColorizer(bytes, std::move(encoder));  // throws if the file is unusable
  TensorFile file = ReadTensorFile(bytes, kColorizerFormat, "the colorizer file");
  FeatureNeighbors::ForgetPositions(&file);
  return WriteTensorFile(file, kColorizerFormat);
}

}  // namespace color3d
