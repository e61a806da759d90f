// Parameters of each ColorizerOptions::Recipe. Torch in the interface; used inside core/colorizer
// only.
#pragma once

#include <torch/types.h>

#include "core/augment/augment.h"
#include "core/colorizer/colorizer.h"
#include "core/colorizer/model/personal_model.h"
#include "core/colorizer/neighbors/feature_neighbors.h"

namespace color3d {

struct TrainingRecipe {
  PersonalModelConfig model;
  AugmentOptions augment;
  double first_learning_rate = 1e-3;
  double last_learning_rate = 1e-6;  // cosine
  int warmup_iterations = 20;
  bool neighbors = true;
  bool exemplar_head = false;  // corrects the neighbours' colours
  FeatureNeighborsOptions neighbor_options;
  // Share of the neighbors in the blend with the decoder, by their agreement on a colour:
  // certainty = doubt^2 / (doubt^2 + variance of the matches' ab). A decoder trained for few
  // iterations is trusted less: share = 1 - (1 - certainty) (1 - exp(-iterations / trust)).
  double neighbor_doubt = 4.0;  // Lab units
  double trust_iterations = 100.0;
};

// Share of the decoder in the blend, 0..`trust`, from the variance of the neighbours' colours.
// `trust`: 0 for an untrained decoder, 1 for one that is trained to the end.
torch::Tensor DecoderShare(const TrainingRecipe& recipe,
                           double trust,
                           const torch::Tensor& neighbor_variance);

TrainingRecipe RecipeFor(const ColorizerOptions& options);

}  // namespace color3d
