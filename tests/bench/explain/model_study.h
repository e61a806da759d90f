// Measures one state of a personalized colorizer (its network alone, as in the paper) on a scene:
// features of matched surfaces, colour differences across views, variance of the answers, Lipschitz
// constants. Torch in the interface. Not thread-safe.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/colorizer/colorizer.h"
#include "core/colorizer/model/personal_model.h"
#include "core/encoder/tap_encoder.h"
#include "tests/bench/explain/answer_variance.h"
#include "tests/bench/explain/color_bound.h"
#include "tests/bench/explain/explain_scene.h"
#include "tests/bench/explain/feature_maps.h"

namespace color3d {

// The model before training, with the statistics of the key view.
std::unique_ptr<PersonalModel> StartModel(const TapEncoder& encoder,
                                          const TrainingPicture& key,
                                          const ColorizerOptions& options);
// Trains it on the key view alone.
void TrainModel(const TrainingPicture& key, const ColorizerOptions& options, PersonalModel* model);

struct StudySizes {
  int draws = 16;       // augmentations of a picture
  int points = 256;     // surface points for the bound
  int jacobians = 8;    // points at which Jacobians are measured
  int iterations = 12;  // of power iteration
  int patch_px = 64;
};

struct ModelStudy {
  std::string name;
  double lambda = 0.0;
  std::vector<FeatureDistance> taps;  // fine to coarse
  FeatureDistance decoder;            // of the decoder's last activation
  FeatureDistance color;              // of the answers, Lab units
  AnswerSpread key_spread;
  AnswerSpread other_spread;  // mean over the other views
  double delta_e00 = 0.0;     // mean over the held-out views; over all but the key view without any
  JacobianNorms norms;
  ColorBound bound;
};

// What a picture of the study shows of one view.
struct ViewMaps {
  Image tap;      // a middle tap of the encoder
  Image decoder;  // the decoder's last activation
  Image colored;  // sRGB: the answer under the view's L
};

class ModelStudies {
 public:
  // The references must outlive the object. Throws Error{kInvalidArgument} if no surface point lies
  // far enough from the borders of two views.
  ModelStudies(const ExplainScene& scene, const TapEncoder& encoder, const StudySizes& sizes);

  ModelStudy Measure(const std::string& name, double lambda, const PersonalModel& model) const;
  ViewMaps Maps(int view, const PersonalModel& model) const;
  // Mean CIEDE2000 of no colour, over the views of ModelStudy::delta_e00.
  double GrayError() const;

 private:
  std::vector<int> ScoredViews() const;
  void CollectPatches();
  void MeasureFeatures(const PersonalModel& model, ModelStudy* study) const;
  void MeasureSpreads(const PersonalModel& model, ModelStudy* study) const;

  const ExplainScene& scene_;
  const TapEncoder& encoder_;
  StudySizes sizes_;
  PatchPairs patches_;
};

}  // namespace color3d
