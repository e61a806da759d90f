// The personalized colorizer (STILL.md "Stage 1d"): frozen ConvNeXt encoder, Conv-Adapters and a
// per-scene decoder, trained on one coloured key view; L in, ab out. No torch in this interface.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/augment/elastic_options.h"
#include "core/base/image.h"
#include "core/color/relative_chroma.h"

namespace color3d {

class Corrector;
struct Correction;

// Exceeds the number of stages of every encoder: Conv-Adapters in all of them.
inline constexpr int kMaxAdapterStages = 8;

// The defaults are those of the service's preset "fast".
struct ColorizerOptions {
  enum class Recipe {
    kColor3d,      // frozen normalisation statistics, mild augmentation, lr 1e-3 -> 1e-6
    kPaper,        // adapters, rot90 + grid shuffle, lr 1e-4 -> 1e-6
    kFeedForward,  // no training: neighbours, corrected by a general head (exemplar_head.h)
  };
  // Precision of matrix products and convolutions in training. All else is float32.
  enum class Precision {
    kAuto,  // bfloat16 if the processor has instructions for it
    kFloat32,
    kBfloat16,
  };
  Recipe recipe = Recipe::kColor3d;
  Precision precision = Precision::kAuto;
  int iterations = 100;  // 0..100000
  // Limit of computing time, 0..86400; the schedule is shortened to fit. 0: no limit. Time spent
  // waiting for a turn in a batch does not count.
  double time_limit_seconds = 0.0;
  // The decoder is not trained if its expected share of the answers, where the carried pictures
  // have no colour, is below this. 0..1; 0: always, 1: never. Not kept in files.
  double min_decoder_share = 0.04;
  int max_side_px = 400;            // of the pictures during training, 64..4096
  int crop_px = 256;                // side of the training crops, 64..1024, clipped to the picture
  double learning_rate = 0.0;       // at the start of the schedule, 0..1; 0: recipe's default
  double consistency_weight = 0.0;  // the paper's A4 term, 0..1000; 0 = off
  // Decay of the exponential moving average of the parameters, 0..0.9999; 0: off. Training returns
  // the better one of the average and the last iteration.
  double average_decay = 0.99;
  // Training stops once the held-out error, smoothed over 3 of the 20 points of the schedule, has
  // fallen by less than this share over the last 4. 0..0.5; 0: never.
  double min_improvement = 0.0;
  // Number of the encoder's deepest stages with Conv-Adapters, 0..8; -1: the recipe's default
  // (kColor3d: none, kPaper: all).
  int adapter_stages = -1;
  bool instance_norm = false;      // norm by each picture's statistics, else by the key view's
  double max_gradient_norm = 1.0;  // gradients above it are scaled down to it, 0..1e6; 0: never
  bool equal_draws = false;        // ignore TrainingPicture::share
  // The decoder ends in a pixel shuffle to the size of the picture. If not, its output has the
  // stride of the encoder's stem and is upsampled, guided by L.
  bool full_resolution = false;
  ElasticOptions elastic;
  double decoder_width = 1.0;  // factor of the decoder's channels, 0.25..4
  bool augment = true;         // transform the training pictures; false: crop them only
  bool neighbors = true;       // kColor3d: feature neighbors; false: the decoder alone
  uint64_t seed = 1;
  // Sets the recipe with its crop, sampling, resolution and elastic transform, without averaging
  // and clipping (PAPER.md).
  void UsePaperRecipe();
  void Validate() const;
  bool operator==(const ColorizerOptions&) const = default;
};

struct ColorPrediction {
  Image ab;  // 2 channels, Lab units
  // 1 channel: mean squared distance per feature dimension to the most similar place of the key
  // view; 0: identical, about 1: nothing similar. Empty for colorizers without neighbors.
  Image distance;
};

// Known facts of a picture besides its luminance: maps of its size, or empty.
struct PictureFacts {
  // 1 channel: pixels above 0 need no prediction. Their colours are unspecified and cost less.
  Image known = Image();
  // 4 channels: position of each pixel's surface in the scene, x y z in units of the scene's
  // radius, and 1; all 0 where it is unknown.
  Image position = Image();
};

// A picture to train on.
struct TrainingPicture {
  std::string name;          // for messages
  Image luminance;           // 1 channel, L 0..100
  Image ab;                  // 2 channels, Lab units, same size
  Image weight = Image();    // 1 channel, 0..1: weight of each pixel in training; empty: 1
  double share = 1.0;        // >= 0: relative probability of being drawn
  Image position = Image();  // as PictureFacts::position; empty: unknown
};

// Immutable, thread-safe.
class Colorizer {
 public:
  virtual ~Colorizer() = default;
  // Colorize plus the distance of each place from the training pictures.
  virtual ColorPrediction Predict(const Image& luminance, const PictureFacts& facts = {}) const = 0;
  // Returns ab (2 channels, Lab units) for L (1 channel, 0..100) of any size. Pictures larger than
  // the training size are coloured at that size and upsampled, guided by L.
  virtual Image Colorize(const Image& luminance) const = 0;
  // Returns a corrector. Without corrections it changes nothing, but proposes places. Where several
  // show the same place, the last one counts. Throws Error{kInvalidArgument} if one paints nothing,
  // kFailedPrecondition if the colorizer has no feature neighbors (the paper's recipe).
  virtual std::unique_ptr<const Corrector> Correct(
      std::span<const Correction> corrections) const = 0;
  // Dependence of the scene's chroma on luminance, measured on the key view.
  virtual RelativeChroma relative_chroma() const = 0;
  // Colorizer file: versioned header, encoder digest, adapters, decoder, training curve.
  virtual std::string Serialize() const = 0;
};

}  // namespace color3d
