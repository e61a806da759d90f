// The finished colorizer: shared encoder, trained model, feature neighbors. Used inside
// core/colorizer only. Immutable and thread-safe.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/colorizer/colorizer.h"
#include "core/colorizer/corrector.h"
#include "core/colorizer/exemplar/exemplar_head.h"
#include "core/colorizer/model/personal_model.h"
#include "core/colorizer/neighbors/feature_neighbors.h"
#include "core/colorizer/personal/train_colorizer.h"
#include "core/colorizer/training/recipe.h"
#include "core/colorizer/training/training_session.h"

namespace color3d {

class PersonalColorizer : public Colorizer {
 public:
  struct Parts {
    std::shared_ptr<const TapEncoder> encoder;
    ColorizerOptions options;
    std::unique_ptr<PersonalModel> model;         // refers to *encoder
    std::unique_ptr<FeatureNeighbors> neighbors;  // may be null
    std::shared_ptr<const ExemplarHead> head;     // corrects the neighbours; may be null
    RelativeChroma relative_chroma;
    std::vector<TrainingPoint> curve;
    int threads = 0;         // for prediction; 0: one per core
    bool decodes = true;     // false: neighbors alone predict
    bool full_size = false;  // PredictionOptions::full_size
  };
  // Rounds the model's parameters to half precision, as in colorizer files.
  explicit PersonalColorizer(Parts parts);

  Image Colorize(const Image& luminance) const override;
  ColorPrediction Predict(const Image& luminance, const PictureFacts& facts = {}) const override;
  std::unique_ptr<const Corrector> Correct(std::span<const Correction> corrections) const override;
  RelativeChroma relative_chroma() const override { return parts_.relative_chroma; }
  std::string Serialize() const override;

  // Steps of Predict, for callers that run the encoder over several pictures at once. They pass the
  // frozen taps (UsesFrozenTaps) of Padded(AtInferenceSize(luminance)).
  static void Check(const Image& luminance);
  static std::pair<int, int> PaddedSize(const Image& small);  // width, height
  static torch::Tensor Padded(const Image& small);
  bool UsesFrozenTaps() const { return !recipe_.model.HasAdapters(); }
  const TapEncoder& encoder() const { return *parts_.encoder; }
  void SetThreads() const;
  Image AtInferenceSize(const Image& luminance) const;
  ColorPrediction PredictFromTaps(const std::vector<torch::Tensor>& taps,
                                  const torch::Tensor& padded,
                                  const Image& small,
                                  const Image& luminance,
                                  const PictureFacts& facts = {}) const;

  static std::shared_ptr<const Colorizer> Deserialize(std::string_view bytes,
                                                      std::shared_ptr<const TapEncoder> encoder,
                                                      int threads,
                                                      const PredictionOptions& use);

 private:
  struct Answer {
    torch::Tensor ab;        // [1,2,H/s,W/s], Lab units
    torch::Tensor distance;  // [h,w] on the neighbors' grid; undefined without neighbors
  };
  // `luminance`: padded L [1,1,H,W].
  Answer Blend(std::vector<torch::Tensor> taps,
               const torch::Tensor& luminance,
               const torch::Tensor& wanted,
               const Image& position) const;
  torch::Tensor DecoderShare(const torch::Tensor& neighbor_variance,
                             const torch::Tensor& decoded) const;
  // Cells of the neighbors' grid that need a prediction, with a margin for interpolation.
  torch::Tensor WantedCells(const Image& known, const Image& small) const;

  Parts parts_;
  TrainingRecipe recipe_;
  double trust_ = 0.0;  // maximum share of the decoder in the blend, 0..1
};

}  // namespace color3d
