// Colour by nearest neighbours in the frozen encoder's features: no training, and as good as some
// hundred decoder iterations. The bank holds features and ab of the key view. Torch in the
// interface; used inside core/colorizer only. Immutable after construction, thread-safe.
#pragma once

#include <torch/types.h>

#include <array>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/random.h"
#include "core/colorizer/archive.h"
#include "core/colorizer/colorizer.h"
#include "core/encoder/convnext/convnext.h"

namespace color3d {

// Defaults measured on three scenes (true colours of held-out views); the error is flat around
// them.
struct FeatureNeighboursOptions {
  std::vector<double> scales{0.8, 1.0, 1.25};  // of the key view, so that sizes may differ
  int bank_size = 12000;                       // cells, drawn at random from all scales
  int further_bank_size = 6000;                // cells of all other pictures together
  double least_weight = 0.25;                  // cells of other pictures that are surer than this
  int dims_per_tap = 16;                       // kept by PCA
  // Shares of the distance for taps at strides 2, 4, 8, 16, 32: fine taps tell texture, coarse ones
  // tell things.
  std::array<double, 5> tap_weights{0.3, 0.5, 1.0, 1.0, 1.0};
  double luminance_weight = 1.0;
  double position_weight = 0.0;  // of the height in the picture; no gain on the whole
  // The softmax's width is temperature * (distance of the best match + floor): sharp where the key
  // view shows the same thing, an average where it shows nothing alike.
  double temperature = 0.1;
  double distance_floor = 0.1;
  int stride = 4;  // px between two answers
};

struct NeighbourColors {
  torch::Tensor ab;        // [2,h,w], Lab units, h = H / stride
  torch::Tensor distance;  // [h,w], mean squared distance per dimension of the best match
  torch::Tensor variance;  // [h,w], of the matches' ab, Lab units squared: how far they disagree
};

class FeatureNeighbours {
 public:
  // Pictures at training size, the key view first: the feature space is its, the others add cells
  // whose colours are known (weight).
  FeatureNeighbours(const TapEncoder& encoder,
                    std::span<const TrainingPicture> pictures,
                    const FeatureNeighboursOptions& options,
                    Random random,
                    const CancellationToken& cancel);
  // From State().
  FeatureNeighbours(const FeatureNeighboursOptions& options,
                    std::map<std::string, torch::Tensor> state);

  // `taps` of a padded picture [1,*,*,*] and its L [1,1,H,W]; H, W multiples of the stride.
  // `picture_height` is the height before padding. `wanted` [h,w] (bool): cells that need an
  // answer, the others get grey at distance 0; undefined: all.
  NeighbourColors Lookup(const std::vector<torch::Tensor>& taps,
                         const torch::Tensor& luminance,
                         int picture_height,
                         const torch::Tensor& wanted = {}) const;

  struct Matches {
    torch::Tensor ab;        // [n,2]
    torch::Tensor distance;  // [n]
    torch::Tensor variance;  // [n]
  };
  // The softmax of squared distances on its own: `queries` [n, D] in the bank's feature space.
  Matches LookupFeatures(const torch::Tensor& queries) const;

  // Tensors that rebuild the bank: projections, bank, colours. The last two are rounded to half
  // precision already, and stored so.
  const std::map<std::string, torch::Tensor>& State() const { return state_; }
  static bool IsStoredAsHalf(const std::string& name) {
    return name == "bank" || name == "colors" || name == "weights";
  }
  // Takes the arrays "neighbours.*" out of the archive. Throws Error{kInvalidArgument} starting
  // with `what` when one is missing or does not fit.
  static std::unique_ptr<FeatureNeighbours> FromArchive(const TapEncoder& encoder,
                                                        const FeatureNeighboursOptions& options,
                                                        const std::string& what,
                                                        Archive& archive);

  // Places of a picture before projection. Internal.
  struct Cells {
    std::vector<torch::Tensor> blocks;  // per tap, then L statistics: [n, channels]
    torch::Tensor positions;            // [n,1]
    torch::Tensor colors;               // [n,2], Lab units
    torch::Tensor weights;              // [n], 0..1
    int64_t Count() const { return weights.size(0); }
  };

 private:
  torch::Tensor Project(const Cells& cells) const;
  torch::Tensor Features(const std::vector<torch::Tensor>& taps,
                         const torch::Tensor& luminance,
                         int picture_height) const;

  FeatureNeighboursOptions options_;
  std::map<std::string, torch::Tensor> state_;
};

}  // namespace color3d
