// Gaussian process regression of what the colours of places change by (STILL.md "Corrections";
// kriging, Rasmussen & Williams 2006, ch. 2). Torch in the interface; used inside core/colorizer
// only. Immutable after construction, thread-safe.
#pragma once

#include <torch/types.h>

#include <cstdint>
#include <vector>

namespace color3d {

struct FieldPlaces {
  torch::Tensor features;   // [n,D] in the bank's space
  torch::Tensor colors;     // [n,2], Lab units: as they are
  torch::Tensor positions;  // [n,4], as CellBank's
  torch::Tensor seen;       // [n], 0..1: share of the colour that a key view shows
};

// How alike the errors of two places' colours are, from 0 to wide + near. Measured on the true
// colours of training views: errors are alike over wide surfaces of one look, and on one surface in
// several views.
struct ChangeFieldOptions {
  double wide = 0.5;
  double wide_looks = 2.0;  // squared feature distance at which that has fallen to 1/e
  double wide_space = 0.2;  // distance at which that has halved, in units of the scene's radius
  double near = 0.4;
  double near_looks = 4.0;
  double near_space = 0.1;  // distance at which that has fallen to 1/e
  double seen_reach = 0.5;  // what a key view shows is its own: difference of `seen` for 1/e
  double noise = 0.1;       // variance of what the user paints over that of the errors
};

class ChangeField {
 public:
  // `wanted` [n,2], Lab units: the colours that `places` should have; `weights` [n], 0..1: how far
  // each is painted; `correction_of_row` [n]: places that a later correction shows as well are left
  // out. n may be 0.
  ChangeField(FieldPlaces places,
              torch::Tensor wanted,
              const torch::Tensor& weights,
              const torch::Tensor& correction_of_row,
              const ChangeFieldOptions& options = {});

  struct Answer {
    // [q,2], Lab units; never beyond the wanted colours of what is most alike: a place that has
    // them already is not wrong as the painted ones were.
    torch::Tensor change;
    torch::Tensor share;  // [q], 0..1: the part of the errors' variance that is told
  };
  Answer At(const FieldPlaces& places) const;

  struct Proposal {
    int64_t row;  // of `places`
    double gain;  // part of the variance at all places that it tells, 0..1
  };
  // The places whose change would tell most of all of them, at most `count`, each after those
  // before it are known (greedy design of experiments). `deviation` [n]: how large errors are
  // expected to be. None twice, and none that tells nothing.
  std::vector<Proposal> Propose(const FieldPlaces& places,
                                const torch::Tensor& deviation,
                                int count) const;

 private:
  torch::Tensor Alike(const FieldPlaces& a, const FieldPlaces& b) const;  // [n_a, n_b]

  ChangeFieldOptions options_;
  FieldPlaces places_;
  torch::Tensor inverse_;           // [n,n], of the covariance of what was painted
  torch::Tensor wanted_;            // [n,2]
  torch::Tensor inverse_x_change_;  // [n,2]
};

}  // namespace color3d
