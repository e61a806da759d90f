#include "core/encoder/lpips/lpips.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/weights/safetensors.h"
#include "tests/reference/perceptual_golden.h"
#include "tests/support/networks/named_values.h"
#include "tests/support/networks/perceptual_weights.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

std::string ErrorText(WeightMap backbone, WeightMap linear) {
  try {
    const Lpips lpips(std::move(backbone), std::move(linear));
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(LpipsTest, AgreesWithReferenceNetworks) {
  const Image one = NamedPicture("one", 80, 72), other = NamedPicture("other", 80, 72);
  const Lpips alex(SmallAlexNetWeights(), SmallLpipsLinearWeights("alex"));
  const Lpips vgg(SmallVggWeights(), SmallLpipsLinearWeights("vgg"));
  EXPECT_NEAR(alex.Distance(one, other), kAlexNetLpips, 1e-4);
  EXPECT_NEAR(vgg.Distance(one, other), kVggLpips, 1e-4);
  EXPECT_NEAR(alex.Distance(other, one), kAlexNetLpips, 1e-4);
  EXPECT_EQ(alex.Distance(one, one), 0.0);
}

TEST(LpipsTest, NoticesTurnedHue) {
  const Lpips alex(SmallAlexNetWeights(), SmallLpipsLinearWeights("alex"));
  const Image picture = NamedPicture("one", 80, 72);
  Image turned = picture;
  for (int c = 0; c < 3; ++c) {
    std::copy_n(picture.Plane((c + 1) % 3), picture.PlaneSize(), turned.Plane(c));
  }
  EXPECT_GT(alex.Distance(picture, turned), 0.05);
}

TEST(LpipsTest, RejectsWeightsOfAnotherNetwork) {
  WeightMap backbone = SmallVggWeights();
  backbone.erase("features.21.bias");
  EXPECT_THAT(ErrorText(backbone, SmallLpipsLinearWeights("vgg")), HasSubstr("features.21.bias"));
  EXPECT_THAT(ErrorText(SmallAlexNetWeights(), SmallLpipsLinearWeights("vgg")),
              HasSubstr("lin1.model.1.weight"));
  EXPECT_THAT(ErrorText(SmallInceptionWeights(1008), SmallLpipsLinearWeights("vgg")),
              HasSubstr("features.0.weight is missing"));
}

TEST(LpipsTest, ReadsWeightFiles) {
  const ScratchFolder folder;
  const auto backbone = folder.path() / "alexnet.safetensors";
  const auto linear = folder.path() / "alex.safetensors";
  WriteFileAtomic(backbone, SerializeSafetensors(SmallAlexNetWeights(), false));
  WriteFileAtomic(linear, SerializeSafetensors(SmallLpipsLinearWeights("alex"), false));
  const auto lpips = Lpips::FromWeightFiles(backbone, linear);
  EXPECT_NEAR(lpips->Distance(NamedPicture("one", 80, 72), NamedPicture("other", 80, 72)),
              kAlexNetLpips,
              1e-4);
}

TEST(LpipsTest, RejectsPicturesItCannotCompare) {
  const Lpips alex(SmallAlexNetWeights(), SmallLpipsLinearWeights("alex"));
  EXPECT_THROW(alex.Distance(Image(80, 72, 3), Image(72, 80, 3)), Error);
  EXPECT_THROW(alex.Distance(Image(80, 63, 3), Image(80, 63, 3)), Error);
  EXPECT_THROW(alex.Distance(Image(80, 72, 2), Image(80, 72, 2)), Error);
}

}  // namespace
}  // namespace color3d
