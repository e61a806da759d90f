// A small encoder, and a key view of two textures in two colours, for fast tests of the colorizer.
#pragma once

#include <gtest/gtest.h>
#include <torch/types.h>

#include <cmath>
#include <vector>

#include "core/colorizer/colorizer.h"
#include "core/colorizer/model/padding.h"
#include "core/colorizer/model/personal_model.h"
#include "core/colorizer/training/recipe.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/torch_threads.h"
#include "tests/support/networks/random_features.h"

namespace color3d {

inline ConvNextConfig SmallEncoder() {
  ConvNextConfig config;
  config.dims = {16, 16};
  config.depths = {1, 1};
  return config;
}

class SmallColorizerTest : public testing::Test {
 protected:
  SmallColorizerTest()
      : encoder_(SmallEncoder(), RandomFeatureWeights(SmallEncoder(), 1), "small") {
    SetTorchThreads(1);  // before the first call
    Image& luminance = pictures_[0].luminance;
    Image& ab = pictures_[0].ab;
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 96; ++x) {
        const bool left = x < 48;
        luminance.At(0, y, x) = 50.0f + 20.0f * std::sin(left ? 0.9f * x : 0.9f * y);
        ab.At(0, y, x) = left ? 40.0f : -40.0f;
        ab.At(1, y, x) = left ? 30.0f : -10.0f;
      }
    }
  }

  torch::Tensor KeyTensor() const {
    return PadToMultiple(TensorFromImage(pictures_[0].luminance), kPadMultiple);
  }
  PersonalModel MakeModel() const {
    Random random(1);
    PersonalModel model(encoder_, recipe_.model, {0.0f, 0.1f}, random);
    model.FreezeStatistics(KeyTensor());
    model.RequireGradients(true);
    return model;
  }

  ConvNext encoder_;
  TrainingRecipe recipe_;
  std::vector<TrainingPicture> pictures_{{"key", Image(96, 64, 1), Image(96, 64, 2)}};
};

}  // namespace color3d
