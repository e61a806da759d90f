// Projects cell features into a space where the squared distance is a mean over blocks of features,
// each with a fixed share. Torch in the interface. Immutable, thread-safe.
#pragma once

#include <torch/types.h>

#include <array>
#include <cstdint>
#include <vector>

namespace color3d {

// Defaults minimize the error on three scenes (true colours of held-out views); the minimum is
// flat.
struct WhiteningOptions {
  int dims_per_block = 16;  // number of leading directions
  // Shares of the distance for taps at strides 2, 4, 8, 16, 32: fine taps encode texture, coarse
  // ones objects.
  std::array<double, 5> tap_shares{0.3, 0.5, 1.0, 1.0, 1.0};
  double luminance_share = 1.0;
};

class Whitening {
 public:
  struct Projection {
    torch::Tensor mean;    // [C]
    torch::Tensor matrix;  // [C, D]: standardise, rotate, scale
  };

  // Fits the projections to a sample of cells: blocks of CellFeatures, with this stride of the
  // finest tap. With the covariances of ViewNoise, distances are in units of that noise, along the
  // directions of highest signal to noise (Mikolajczyk & Matas 2007); without, along the principal
  // components.
  Whitening(const std::vector<torch::Tensor>& blocks,
            int first_stride_px,
            const WhiteningOptions& options,
            const std::vector<torch::Tensor>& view_noise = {});
  // Restores from projections().
  explicit Whitening(std::vector<Projection> projections);

  // Returns [cells, Columns()], in the common space.
  torch::Tensor Apply(const std::vector<torch::Tensor>& blocks) const;
  // Total columns of all projections, rounded up to a multiple of 8 with zeros.
  int64_t Columns() const { return columns_; }
  const std::vector<Projection>& projections() const { return projections_; }

 private:
  std::vector<Projection> projections_;
  int64_t columns_ = 0;
};

}  // namespace color3d
