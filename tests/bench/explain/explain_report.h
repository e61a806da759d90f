// The outputs of `color3d-bench explain`: a picture of features, and tables. Pure functions.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/image.h"
#include "tests/bench/explain/model_study.h"

namespace color3d {

// One view of the picture: a column.
struct FeatureColumn {
  std::string name;
  Image luminance;  // 0..100
  ViewMaps before;
  ViewMaps after;
};
// Rows: the photo in grey, the encoder's features, the decoder's before and after training, the
// answers after training. Features are shown by PrincipalMaps, over all views of a row. sRGB.
// Requires: there are columns.
Image FeaturePicture(const std::vector<FeatureColumn>& columns);

struct ExplainFacts {
  std::string scene;
  std::string key_view;
  std::string encoder;
  int views = 0;
  int pairs = 0;
  double gray = 0.0;  // CIEDE2000 of no colour
  bool has_adapters = false;
  std::vector<int> strides;  // of the taps, px
};

// Requires: studies[0] is the model before training, and there is a trained one.
std::string ExplainMarkdown(const ExplainFacts& facts, const std::vector<ModelStudy>& studies);
nlohmann::ordered_json ExplainJson(const ExplainFacts& facts,
                                   const std::vector<ModelStudy>& studies);

}  // namespace color3d
