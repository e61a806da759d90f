#include "core/image/weighted_resize.h"

#include <gtest/gtest.h>

#include <utility>

#include "core/base/random.h"
#include "core/image/codec.h"
#include "core/image/fill_holes.h"

namespace color3d {
namespace {

// 40 where known, another value elsewhere.
struct HalfKnown {
  Image values{50, 38, 2, 40.0f};
  Image weight{50, 38, 1};

  explicit HalfKnown(float elsewhere) {
    Random random(5);
    for (size_t i = 0; i < weight.data.size(); ++i) {
      const bool known = random.NextUniform() < 0.3;
      weight.data[i] = known ? static_cast<float>(random.NextUniform(0.1, 1.0)) : 0.0f;
      for (int c = 0; c < 2 && !known; ++c) values.Plane(c)[i] = elsewhere;
    }
  }
};

TEST(ResizeWeighted, ZeroWeightDoesNotLeak) {
  const HalfKnown picture(0.0f);
  for (const auto& [width, height] : {std::pair{25, 19}, {17, 11}, {80, 61}}) {
    const Image out = ResizeWeighted(picture.values, picture.weight, width, height);
    const Image weight = Resize(picture.weight, width, height);
    for (size_t i = 0; i < weight.data.size(); ++i) {
      if (weight.data[i] < 1e-3f) continue;
      EXPECT_NEAR(out.Plane(0)[i], 40.0f, 1e-2);
      EXPECT_NEAR(out.Plane(1)[i], 40.0f, 1e-2);
    }
  }
}

TEST(ResizeWeighted, EqualWeightsChangeNothing) {
  Image values(31, 22, 1);
  Random random(1);
  for (float& v : values.data) v = static_cast<float>(random.NextUniform(-50.0, 50.0));
  const Image plain = Resize(values, 13, 9);
  const Image weighted = ResizeWeighted(values, Image(31, 22, 1, 0.4f), 13, 9);
  for (size_t i = 0; i < plain.data.size(); ++i) {
    EXPECT_NEAR(weighted.data[i], plain.data[i], 1e-3);
  }
  EXPECT_EQ(ResizeWeighted(values, Image(31, 22, 1), 13, 9).data, plain.data);
}

TEST(FillHoles, UnknownPixelsContinueKnownOnes) {
  HalfKnown picture(-100.0f);
  const Image before = picture.values;
  FillHoles(picture.weight, &picture.values);
  for (size_t i = 0; i < picture.weight.data.size(); ++i) {
    EXPECT_NEAR(picture.values.Plane(0)[i], 40.0f, 1e-3);
    if (picture.weight.data[i] > 0.0f) {
      EXPECT_EQ(picture.values.Plane(1)[i], before.Plane(1)[i]);
    }
  }
}

}  // namespace
}  // namespace color3d
