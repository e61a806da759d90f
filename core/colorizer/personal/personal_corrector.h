// The corrector of a personalized colorizer: a Gaussian process in the space of its feature
// neighbors. Used inside core/colorizer only. Immutable and thread-safe.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/color/relative_chroma.h"
#include "core/colorizer/corrector.h"
#include "core/colorizer/neighbors/change_field.h"
#include "core/colorizer/neighbors/feature_neighbors.h"
#include "core/encoder/tap_encoder.h"

namespace color3d {

class PersonalCorrector : public Corrector {
 public:
  // `encoder` and `learnt` must outlive the object. Pictures are reduced to a longer side of at
  // most `max_side_px`.
  PersonalCorrector(const TapEncoder& encoder,
                    const FeatureNeighbors& learnt,
                    RelativeChroma relative_chroma,
                    int max_side_px,
                    int threads,
                    std::span<const Correction> corrections);

  PictureCells Describe(const Image& luminance, const Image& position) const override;
  CorrectedColor Predict(const PlacedPicture& picture,
                         const PictureCells& cells,
                         int samples) const override;
  std::vector<ProposedPlace> Propose(std::span<const PlaceSample> samples,
                                     int count) const override;

 private:
  // Samples up to `wanted` cells of a picture with this L, outside the padding.
  PlaceSample Sample(const FieldPlaces& places,
                     int64_t columns,
                     const Image& luminance,
                     int wanted) const;

  const TapEncoder& encoder_;
  const FeatureNeighbors& learnt_;
  const RelativeChroma relative_chroma_;
  const int max_side_px_;
  const int threads_;
  std::optional<ChangeField> field_;
};

}  // namespace color3d
