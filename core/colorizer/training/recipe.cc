#include "core/colorizer/training/recipe.h"

#include <torch/types.h>

namespace color3d {
namespace {

// On other processors bfloat16 is emulated, slower than float32.
bool HasBfloat16Products() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx512bf16") != 0;
#else
  return false;
#endif
}

}  // namespace

torch::Tensor DecoderShare(const TrainingRecipe& recipe,
                           double trust,
                           const torch::Tensor& neighbor_variance) {
  const double doubt = recipe.neighbor_doubt * recipe.neighbor_doubt;
  return trust * neighbor_variance / (doubt + neighbor_variance);
}

TrainingRecipe RecipeFor(const ColorizerOptions& options) {
  // kColor3d has no adapters: on random features they did not reduce the error (fern 3.77 against
  // 3.75) and slowed iterations down, because gradients then pass through the encoder.
  TrainingRecipe recipe;
  if (options.recipe == ColorizerOptions::Recipe::kPaper) {
    recipe.model.adapter_stages = kMaxAdapterStages;
    recipe.augment = AugmentOptions::Paper();
    recipe.first_learning_rate = 1e-4;
    recipe.warmup_iterations = 0;
    recipe.neighbors = false;
  }
  recipe.neighbors = recipe.neighbors && options.neighbors;
  recipe.augment.elastic = options.elastic;
  if (!options.augment) recipe.augment = AugmentOptions::CropsOnly();
  recipe.exemplar_head = options.recipe == ColorizerOptions::Recipe::kFeedForward;
  if (options.adapter_stages >= 0) recipe.model.adapter_stages = options.adapter_stages;
  recipe.model.decoder_width = options.decoder_width;
  recipe.model.full_resolution = options.full_resolution;
  recipe.model.instance_norm = options.instance_norm;
  if (options.learning_rate > 0.0) recipe.first_learning_rate = options.learning_rate;
  recipe.model.half_products =
      options.precision == ColorizerOptions::Precision::kBfloat16 ||
      (options.precision == ColorizerOptions::Precision::kAuto && HasBfloat16Products());
  return recipe;
}

}  // namespace color3d
