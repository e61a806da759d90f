#include "core/keycolor/edit_model.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace color3d {
namespace {

// Left half: (60, 5, 50), edited. Right half: (60, 5, -20), not edited. The edit moves a by 30 and
// scales b by 0.5.
EditedPicture TwoHalves() {
  EditedPicture picture{Image(40, 20, 3, 60.0f), Image(40, 20, 2), Image(40, 20, 1)};
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 40; ++x) {
      const bool left = x < 20;
      picture.lab.At(1, y, x) = 5.0f;
      picture.lab.At(2, y, x) = left ? 50.0f : -20.0f;
      picture.ab.At(0, y, x) = left ? 35.0f : 5.0f;
      picture.ab.At(1, y, x) = left ? 25.0f : -20.0f;
      picture.edited.At(0, y, x) = left ? 1.0f : 0.0f;
    }
  }
  return picture;
}

TEST(EditModelTest, AnswersWithChangeOfSeenColor) {
  const EditedPicture picture = TwoHalves();
  const EditModel model({&picture, 1});
  const EditModel::Answer edited = model.At(60.0f, 5.0f, 50.0f);
  EXPECT_NEAR(edited.change[0], 30.0f, 0.1f);
  EXPECT_NEAR(edited.change[1], -25.0f, 0.1f);
  EXPECT_LT(edited.variance, 1.0f);
  EXPECT_GT(edited.likelihood_ratio, 50.0f);
  EXPECT_LT(model.At(60.0f, 5.0f, -20.0f).likelihood_ratio, 0.02f);
}

TEST(EditModelTest, IsUndecidedOnUnseenColor) {
  const EditedPicture picture = TwoHalves();
  const EditModel::Answer answer = EditModel({&picture, 1}).At(20.0f, -60.0f, 10.0f);
  EXPECT_FLOAT_EQ(answer.likelihood_ratio, 1.0f);
  EXPECT_NEAR(answer.change[0], 30.0f, 0.1f);  // the mean change
}

TEST(EditModelTest, ReportsVarianceOfContradictingEdits) {
  EditedPicture picture = TwoHalves();
  // Equal colours, half of them moved the other way.
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 20; ++x) picture.ab.At(0, y, x) = -25.0f;
  }
  const EditModel::Answer answer = EditModel({&picture, 1}).At(60.0f, 5.0f, 50.0f);
  EXPECT_NEAR(answer.change[0], 0.0f, 0.5f);
  EXPECT_NEAR(answer.variance, 30.0f * 30.0f, 20.0f);
}

TEST(EditModelTest, ChangesNothingWithoutEdit) {
  EditedPicture picture = TwoHalves();
  std::ranges::fill(picture.edited.data, 0.0f);
  const EditModel::Answer answer = EditModel({&picture, 1}).At(60.0f, 5.0f, 50.0f);
  EXPECT_EQ(answer.change[0], 0.0f);
  EXPECT_EQ(answer.likelihood_ratio, 1.0f);
}

TEST(EditModelTest, IsUndecidedWhereAllIsEdited) {
  EditedPicture picture = TwoHalves();
  std::ranges::fill(picture.edited.data, 1.0f);
  EXPECT_EQ(EditModel({&picture, 1}).At(60.0f, 5.0f, 50.0f).likelihood_ratio, 1.0f);
}

TEST(EditModelTest, PosteriorKeepsCertainty) {
  EXPECT_EQ(EditedPosterior(0.0f, 1e6f), 0.0f);
  EXPECT_NEAR(EditedPosterior(1.0f, 1e-3f), 1.0f, 1e-3f);
  EXPECT_FLOAT_EQ(EditedPosterior(0.5f, 1.0f), 0.5f);
  EXPECT_NEAR(EditedPosterior(0.1f, 9.0f), 0.5f, 1e-6f);
}

}  // namespace
}  // namespace color3d
