#include "core/colorizer/colorizer.h"

#include "core/base/range_check.h"

namespace color3d {

void ColorizerOptions::UsePaperRecipe() {
  recipe = Recipe::kPaper;
  crop_px = 320;
  average_decay = 0.0;
  max_gradient_norm = 0.0;
  equal_draws = true;
  instance_norm = true;
  full_resolution = true;
  elastic.kind = ElasticOptions::Kind::kNoise;
}

void ColorizerOptions::Validate() const {
  const RangeCheck check("colorizer option");
  check("iterations", iterations, 0, 100000);
  check("time_limit_seconds", time_limit_seconds, 0, 86400);
  check("max_side_px", max_side_px, 64, 4096);
  check("crop_px", crop_px, 64, 1024);
  check("learning_rate", learning_rate, 0, 1);
  check("consistency_weight", consistency_weight, 0, 1e3);
  check("average_decay", average_decay, 0, 0.9999);
  check("min_improvement", min_improvement, 0, 0.5);
  check("min_decoder_share", min_decoder_share, 0, 1);
  check("adapter_stages", adapter_stages, -1, kMaxAdapterStages);
  check("decoder_width", decoder_width, 0.25, 4);
  check("max_gradient_norm", max_gradient_norm, 0, 1e6);
  check("elastic_alpha_px", elastic.alpha_px, 0, 10000);
  check("elastic_sigma_px", elastic.sigma_px, 1, 1000);
  check("elastic_affine_px", elastic.affine_px, 0, 1000);
}

}  // namespace color3d
