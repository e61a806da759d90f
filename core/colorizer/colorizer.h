// The personalized colorizer (STILL.md "Stage 1d"): frozen ConvNeXt encoder, Conv-Adapters and a
// per-scene decoder, trained on one coloured key view; L in, ab out. No torch in this interface.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/image.h"
#include "core/base/run_control.h"
#include "core/color/relative_chroma.h"
#include "core/encoder/encoder.h"

namespace color3d {

class Corrector;
class SceneBatch;
struct Correction;

// The defaults are those of the service's preset "fast".
struct ColorizerOptions {
  enum class Recipe {
    kColor3d,  // frozen normalisation statistics, mild augmentation, lr 1e-3 -> 1e-6
    kPaper,    // instance norm, rot90 + grid shuffle + elastic, lr 1e-4 -> 1e-6
  };
  // Of matrix products and convolutions while training; the rest is float32 always.
  enum class Precision {
    kAuto,  // bfloat16 where the processor has instructions for it
    kFloat32,
    kBfloat16,
  };
  Recipe recipe = Recipe::kColor3d;
  Precision precision = Precision::kAuto;
  int iterations = 100;  // 0..100000
  // > 0: the schedule is shortened to end after so many seconds of computing, at most 86400 (in a
  // batch a scene also waits for its turns, which does not count).
  double time_limit_seconds = 0.0;
  int max_side_px = 400;            // of the key view during training, 64..2048
  int crop_px = 256;                // side of the training crops, 64..1024, clipped to the picture
  double learning_rate = 0.0;       // at the start of the schedule, 0..1; 0: the recipe's
  double consistency_weight = 0.0;  // the paper's A4 term, 0..1000; 0 = off
  // Exponential mean of the parameters over iterations, 0..0.9999; 0 = off. The better one of mean
  // and last is delivered.
  double average_decay = 0.99;
  // Training stops when the held-out error, smoothed over 3 of 20 points of the schedule, has
  // fallen by less than this share over the last 4; 0..0.5, 0 = never.
  double min_improvement = 0.0;
  // How many of the encoder's deepest stages get Conv-Adapters, 0..8; -1: ours none, the paper all.
  int adapter_stages = -1;
  double decoder_width = 1.0;  // factor on the decoder's channels, 0.25..4
  uint64_t seed = 1;
  // Sets the recipe and its crop of 320 px.
  void UsePaperRecipe();
  void Validate() const;
  bool operator==(const ColorizerOptions&) const = default;
};

struct ColorPrediction {
  Image ab;  // 2 channels, Lab units
  // 1 channel: mean squared distance per feature dimension to the most similar place of the key
  // view, 0: the same; about 1 where nothing is alike. Empty for colorizers without neighbors.
  Image distance;
};

// What is known of a picture beside its luminance: maps of its size, or empty.
struct PictureFacts {
  // 1 channel: places above 0 need no answer; what they get means nothing, and costs less.
  Image known = Image();
  // 4 channels: where in the scene each pixel's surface lies, x y z in units of the scene's radius,
  // and 1; where that is not known all are 0.
  Image position = Image();
};

// One picture to learn from.
struct TrainingPicture {
  std::string name;        // for messages
  Image luminance;         // 1 channel, L 0..100
  Image ab;                // 2 channels, Lab units, same size
  Image weight = Image();  // 1 channel, 0..1: how far each pixel's colour is to be learnt; empty: 1
  double share = 1.0;      // >= 0: relative probability of being drawn
  Image position = Image();  // as PictureFacts'; empty: not known
};

// Immutable once trained; thread-safe to use.
class Colorizer {
 public:
  virtual ~Colorizer() = default;
  // As Colorize, with how far each place is from anything that was seen.
  virtual ColorPrediction Predict(const Image& luminance, const PictureFacts& facts = {}) const = 0;
  // 1-channel L (0..100) of any size -> 2-channel ab (Lab units) of the same size. Pictures larger
  // than the training size are coloured at that size and upsampled guided by L.
  virtual Image Colorize(const Image& luminance) const = 0;
  // `corrections` may be empty: then nothing changes, and only Corrector::Propose is of use. Where
  // two of them show one place the later one counts. Throws Error{kInvalidArgument} when one paints
  // nothing, kFailedPrecondition for colorizers without feature neighbors (the paper's recipe).
  virtual std::unique_ptr<const Corrector> Correct(
      std::span<const Correction> corrections) const = 0;
  // How the scene's chroma depends on luminance, as the key view shows it.
  virtual RelativeChroma relative_chroma() const = 0;
  // Colorizer file: versioned header, encoder digest, adapters, decoder, training curve.
  virtual std::string Serialize() const = 0;
};

// A scene's place among those that train together (scene_batch.h).
struct BatchPlace {
  SceneBatch& batch;
  std::string project;  // what fairness is between, e.g. the submitted job
};

// `pictures`: the undistorted key view first (statistics, neighbors and held-out augmentations are
// its), then others of the scene, of any size. Reports "train_l1_ab" and, on views of the key that
// are never trained on (held-out augmentations), "validation_delta_e00". Gradient clipping; a
// non-finite loss restores the last good state with half the step and warns. Resumable. With a
// `place` it takes turns with the other scenes of the batch; the result is the same, bit for bit,
// as it is for any number of threads. The colorizer answers on as many threads as the pool has.
std::shared_ptr<const Colorizer> TrainColorizer(std::shared_ptr<const Encoder> encoder,
                                                std::vector<TrainingPicture> pictures,
                                                const ColorizerOptions& options,
                                                const RunControl& control,
                                                const std::optional<BatchPlace>& place = {});

// Answers on `threads` threads; 0: what the machine has. Throws Error{kInvalidArgument} on a
// damaged file, kFailedPrecondition when it was trained on another encoder (both digests are
// named).
std::shared_ptr<const Colorizer> LoadColorizer(std::string_view bytes,
                                               std::shared_ptr<const Encoder> encoder,
                                               int threads = 0);

}  // namespace color3d
