#include "core/metrics/view_scores.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"

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

// Fine coloured stripes, `width` px wide pictures of the same scene.
Image Stripes(int width, float shift) {
  Image srgb(width, width * 3 / 4, 3);
  for (int y = 0; y < srgb.height; ++y) {
    for (int x = 0; x < srgb.width; ++x) {
      const double phase = 400.0 * (x + 0.5) / width + 100.0 * (y + 0.5) / srgb.height;
      srgb.At(0, y, x) = static_cast<float>(0.5 + 0.3 * std::sin(phase));
      srgb.At(1, y, x) = 0.4f + shift;
      srgb.At(2, y, x) = static_cast<float>(0.5 - 0.3 * std::sin(phase));
    }
  }
  return srgb;
}

// Scores of larger pictures are those of the pictures at the common size.
TEST(ScoreView, ReducesLargePicturesToTheCommonSize) {
  const Image truth = LabFromSrgb(Stripes(2 * kScoreSidePx, 0.0f));
  const Image wrong = LabFromSrgb(Stripes(2 * kScoreSidePx, 0.1f));
  const Scores large = ScoreView(SrgbFromLab(truth), wrong, ChromaOfLab(wrong));
  const Image reduced = FitWithin(wrong, kScoreSidePx);
  const Scores small =
      ScoreView(SrgbFromLab(FitWithin(truth, kScoreSidePx)), reduced, ChromaOfLab(reduced));
  for (const auto& [name, value] : small) {
    EXPECT_NEAR(large.at(name), value, 1e-3 * std::abs(value) + 1e-4) << name;
  }
  EXPECT_GT(small.at("delta_e00_chroma"), 1.0);
}

// The scores of a masked picture equal those of its cropped half.
TEST(ScoreView, CountsUnmaskedPixelsOnly) {
  const Image truth = Stripes(96, 0.0f), drawn = LabFromSrgb(Stripes(96, 0.1f));
  Image mask(96, 72, 1), spoilt = drawn;
  const auto left = [](const Image& image) {
    Image half(48, 72, image.channels);
    for (int c = 0; c < image.channels; ++c) {
      for (int y = 0; y < 72; ++y) {
        for (int x = 0; x < 48; ++x) half.At(c, y, x) = image.At(c, y, x);
      }
    }
    return half;
  };
  for (int y = 0; y < 72; ++y) {
    for (int x = 0; x < 96; ++x) {
      mask.At(0, y, x) = x < 48 ? 1.0f : 0.0f;
      if (x >= 48) spoilt.At(0, y, x) = 0.0f;
    }
  }
  const Scores cropped = ScoreView(left(truth), left(drawn), ChromaOfLab(left(drawn)));
  const Scores masked = ScoreView(truth, spoilt, ChromaOfLab(spoilt), &mask);
  for (const auto& [name, value] : cropped) {
    EXPECT_NEAR(masked.at(name), value, name == "ssim_rgb" ? 0.03 : 1e-6) << name;
  }
  EXPECT_EQ(masked, ScoreView(truth, drawn, ChromaOfLab(drawn), &mask));
  EXPECT_LT(ScoreView(truth, spoilt, ChromaOfLab(spoilt)).at("psnr_l"), masked.at("psnr_l") - 3.0);
  const Image whole(96, 72, 1, 1.0f);
  EXPECT_EQ(ScoreView(truth, spoilt, ChromaOfLab(spoilt), &whole),
            ScoreView(truth, spoilt, ChromaOfLab(spoilt)));
  const Image nothing(96, 72, 1);
  EXPECT_TRUE(ScoreView(truth, drawn, ChromaOfLab(drawn), &nothing).empty());
}

// A fifth of the pixels has the wrong chroma: the percentile is its error, the mean a fifth of it.
TEST(ScoreView, PercentileShowsSmallWrongParts) {
  const Image truth(100, 50, 3, 0.5f);
  Image lab = LabFromSrgb(truth);
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 100; ++x) lab.At(1, y, x) = 20.0f;
  }
  const Scores scores = ScoreView(truth, lab, ChromaOfLab(lab));
  EXPECT_GT(scores.at("delta_e00_chroma_p90"), 10.0);
  EXPECT_NEAR(scores.at("delta_e00_chroma"), 0.2 * scores.at("delta_e00_chroma_p90"), 0.01);
  for (int y = 5; y < 10; ++y) {
    for (int x = 0; x < 100; ++x) lab.At(1, y, x) = 0.0f;
  }
  const Scores tenth = ScoreView(truth, lab, ChromaOfLab(lab));
  EXPECT_NEAR(tenth.at("delta_e00_chroma_p90"), 0.0, 0.05);
}

TEST(SourceErrors, GoodConfidenceCorrelatesWithErrors) {
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

TEST(SourceErrors, ManyViewsGiveTheSameResult) {
  const int side = 400;
  const Image truth(side, side, 3, 0.5f);
  Image ab(side, side, 2), shares(side, side, 3);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const int hash = (x * 7919 + y * 104729) % 97;
      ab.At(0, y, x) = static_cast<float>(hash % 31);
      shares.At(hash < 40 ? 1 : 2, y, x) = 1.0f;
    }
  }
  SourceErrors one, many;
  one.Add(truth, ab, shares);
  for (int i = 0; i < 30; ++i) many.Add(truth, ab, shares);  // 4.8 million pixels
  const Scores of_one = one.Result(), of_many = many.Result();
  for (const char* name : {"share_seen", "delta_e00_seen", "delta_e00_inferred"}) {
    EXPECT_NEAR(of_many.at(name), of_one.at(name), 1e-6) << name;
  }
  EXPECT_NEAR(
      of_many.at("confidence_rank_correlation"), of_one.at("confidence_rank_correlation"), 0.02);
}

}  // namespace
}  // namespace color3d
