#include "core/color/lab_planes.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/color/lab.h"

namespace color3d {
namespace {

TEST(LabPlanesTest, JoinLabInvertsSplit) {
  Image lab(3, 2, 3);
  for (size_t i = 0; i < lab.data.size(); ++i) lab.data[i] = static_cast<float>(i);
  EXPECT_EQ(LuminanceOfLab(lab).At(0, 1, 2), 5.0f);
  EXPECT_EQ(ChromaOfLab(lab).At(1, 1, 2), 17.0f);
  EXPECT_EQ(JoinLab(LuminanceOfLab(lab), ChromaOfLab(lab)).data, lab.data);
}

TEST(LabPlanesTest, RejectsWrongChannelCount) {
  EXPECT_THROW(LuminanceOfLab(Image(2, 2, 1)), Error);
  EXPECT_THROW(ChromaOfLab(Image(2, 2, 2)), Error);
}

}  // namespace
}  // namespace color3d
