// Gaussian process regression of colour changes (STILL.md "Corrections";
// kriging, Rasmussen & Williams 2006, ch. 2). Torch in the interface; used inside core/colorizer
// only. Immutable after construction, thread-safe.
#pragma once

#include <torch/types.h>

#include <cstdint>
#include <vector>

namespace color3d {

struct FieldPlaces {
  torch::Tensor features;   // [n,D], in the space of the cell bank
  torch::Tensor colors;     // [n,2], Lab units: current colours
  torch::Tensor positions;  // [n,4], as in CellBank
  torch::Tensor seen;       // [n], 0..1: share of the colour seen in a key view
};

// Covariance of the colour errors at two places, 0 to wide + near. Measured on the true colours of
// training views: errors correlate over large areas with similar features, and on one surface
// across views.
struct ChangeFieldOptions {
  double wide = 0.5;
  double wide_feature_reach = 2.0;  // squared feature distance at which `wide` falls to 1/e
  double wide_space_reach = 0.2;  // distance at which `wide` halves, in units of the scene's radius
  double near = 0.4;
  double near_feature_reach = 4.0;
  double near_space_reach = 0.1;  // distance at which `near` falls to 1/e
  double seen_reach = 0.5;        // difference of `seen` at which the covariance falls to 1/e
  double noise = 0.1;             // variance of painted colours relative to that of the errors
};

class ChangeField {
 public:
  // `wanted` [n,2], Lab units: target colours of `places`; `weights` [n], 0..1: opacity of the
  // paint; `correction_of_row` [n]: index of the correction; `reach_of_row` [n], > 0: its reach.
  // Places that a later correction shows too are dropped. n may be 0.
  ChangeField(FieldPlaces places,
              torch::Tensor wanted,
              const torch::Tensor& weights,
              const torch::Tensor& correction_of_row,
              const torch::Tensor& reach_of_row,
              const ChangeFieldOptions& options = {});

  struct Answer {
    // [q,2], Lab units. Never moves a colour past the target colour of the most similar places: a
    // place that already has the target colour does not share the error of the painted ones.
    torch::Tensor change;
    torch::Tensor share;  // [q], 0..1: explained share of the variance of the errors, ^(1 / reach)
    torch::Tensor pull;   // [q], 0..1: what the last correction has of it, at a reach of 1
  };
  Answer At(const FieldPlaces& places) const;

  struct Proposal {
    int64_t row;  // of `places`
    double gain;  // share of the variance at all places that it explains, 0..1
  };
  // Returns at most `count` distinct places whose observation explains most of the variance at all
  // places, each given those before it (greedy experimental design). `deviation` [n]: expected
  // error. Places without gain are omitted.
  std::vector<Proposal> Propose(const FieldPlaces& places,
                                const torch::Tensor& deviation,
                                int count) const;

 private:
  torch::Tensor Covariance(const FieldPlaces& a, const FieldPlaces& b) const;  // [n_a, n_b]

  ChangeFieldOptions options_;
  FieldPlaces places_;
  torch::Tensor inverse_;           // [n,n], inverse covariance of the painted places
  torch::Tensor wanted_;            // [n,2]
  torch::Tensor inverse_x_change_;  // [n,2]
  torch::Tensor narrowing_;         // [n], 1 / reach; undefined if all reaches are 1
  torch::Tensor is_last_;           // [n], 1 for the last correction, else 0
};

}  // namespace color3d
