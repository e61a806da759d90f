// What a user's corrections do to other places: cells of the corrected pictures compete with those
// that the colorizer learnt from. Used inside core/colorizer only. Immutable, thread-safe.
#pragma once

#include <memory>
#include <span>

#include "core/colorizer/colorizer.h"
#include "core/colorizer/feature_neighbors.h"

namespace color3d {

struct CorrectionOptions {
  int rivals = 3000;  // cells of what was learnt, drawn at random
  // What was learnt of a place that a correction covers is wrong: a rival's weight is
  // 1 - exp(-distance / reach) of its squared distance to the nearest corrected cell.
  double reach = 1.0;
  VoteOptions vote{.median_steps = 5, .position_weight = 1.5};
};

class PersonalCorrector : public Corrector {
 public:
  // Pictures are looked at with their longer side at most `max_side_px`.
  PersonalCorrector(std::shared_ptr<const TapEncoder> encoder,
                    const FeatureNeighbors& learnt,
                    RelativeChroma relative_chroma,
                    int max_side_px,
                    int threads,
                    std::span<const TrainingPicture> corrected,
                    const CorrectionOptions& options = {});

  CorrectedColor Predict(const Image& luminance, const PictureFacts& facts = {}) const override;

 private:
  const std::shared_ptr<const TapEncoder> encoder_;
  const Whitening whitening_;
  const RelativeChroma relative_chroma_;
  const int max_side_px_;
  const int threads_;
  const CorrectionOptions options_;
  CellBank corrected_;
  CellBank rivals_and_corrected_;  // "colors": 1 for corrected cells, 0 for rivals, and 0
};

}  // namespace color3d
