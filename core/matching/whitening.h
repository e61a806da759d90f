// Brings cell features into a space where a squared distance is a mean over kinds of features, each
// with a fixed share. Torch in the interface. Immutable after construction, thread-safe.
#pragma once

#include <torch/types.h>

#include <array>
#include <cstdint>
#include <vector>

namespace color3d {

// Defaults measured on three scenes (true colours of held-out views); the error is flat around
// them.
struct WhiteningOptions {
  int dims_per_block = 16;  // leading directions that are kept
  // Shares of the distance for taps at strides 2, 4, 8, 16, 32: fine taps tell texture, coarse ones
  // tell things.
  std::array<double, 5> tap_shares{0.3, 0.5, 1.0, 1.0, 1.0};
  double luminance_share = 1.0;
};

class Whitening {
 public:
  struct Projection {
    torch::Tensor mean;    // [C]
    torch::Tensor matrix;  // [C, D]: standardise, rotate, scale
  };

  // From a sample of cells: CellFeatures' blocks, whose finest tap has this stride. With
  // ViewNoise's covariances distances are measured in that noise, along the directions that stand
  // out of it most (Mikolajczyk & Matas 2007); without, along the principal components.
  Whitening(const std::vector<torch::Tensor>& blocks,
            int first_stride_px,
            const WhiteningOptions& options,
            const std::vector<torch::Tensor>& view_noise = {});
  // From projections().
  explicit Whitening(std::vector<Projection> projections);

  // [cells, Columns()] in the common space.
  torch::Tensor Apply(const std::vector<torch::Tensor>& blocks) const;
  // The sum of all projections' columns and as many zeros as make whole vectors of 8.
  int64_t Columns() const { return columns_; }
  const std::vector<Projection>& projections() const { return projections_; }

 private:
  std::vector<Projection> projections_;
  int64_t columns_ = 0;
};

}  // namespace color3d
