#include "core/metrics/view_scores.h"

#include <gtest/gtest.h>

#include <array>

namespace color3d {
namespace {

// Shares (guessed, seen, inferred) in the left and the right half.
Image Halves(const std::array<float, 3>& left, const std::array<float, 3>& right) {
  Image shares(48, 32, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 32; ++y) {
      for (int x = 0; x < 48; ++x) shares.At(c, y, x) = x < 24 ? left[c] : right[c];
    }
  }
  return shares;
}

TEST(SourceErrors, ConfidenceThatKnowsTheErrorsCorrelatesWithThem) {
  const Image truth(48, 32, 3, 0.5f);
  Image ab(48, 32, 2);
  for (int y = 0; y < 32; ++y) {
    for (int x = 24; x < 48; ++x) ab.At(0, y, x) = 20.0f;
  }
  SourceErrors good, wrong;
  good.Add(truth, ab, Halves({0.0f, 1.0f, 0.0f}, {0.2f, 0.0f, 0.8f}));
  EXPECT_NEAR(good.Result().at("confidence_rank_correlation"), -1.0, 1e-6);
  EXPECT_NEAR(good.Result().at("delta_e00_seen"), 0.0, 0.01);
  EXPECT_GT(good.Result().at("delta_e00_inferred"), 5.0);
  wrong.Add(truth, ab, Halves({1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}));
  EXPECT_NEAR(wrong.Result().at("confidence_rank_correlation"), 1.0, 1e-6);
}

}  // namespace
}  // namespace color3d
