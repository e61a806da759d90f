#include "core/video/hdr_tones.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace color3d {
namespace {

float Mapped(const HdrTones& tones, float value) {
  Image image(1, 1, 3, value);
  tones.Apply(&image);
  EXPECT_NEAR(image.At(0, 0, 0), image.At(1, 0, 0), 1e-4);
  EXPECT_NEAR(image.At(2, 0, 0), image.At(1, 0, 0), 1e-4);
  return image.At(1, 0, 0);
}

// ST 2084 and BT.2408, table 1.
TEST(HdrTones, PqMatchesStandard) {
  EXPECT_NEAR(PqNits(0.0), 0.0, 1e-9);
  EXPECT_NEAR(PqNits(1.0), 10000.0, 1e-6);
  EXPECT_NEAR(PqNits(0.58), 203.0, 2.0);
  EXPECT_NEAR(PqValue(100.0), 0.508, 1e-3);
  EXPECT_NEAR(PqValue(1000.0), 0.752, 1e-3);
  for (const double nits : {0.01, 1.0, 203.0, 4000.0}) {
    EXPECT_NEAR(PqNits(PqValue(nits)), nits, 1e-6 * nits);
  }
}

TEST(HdrTones, CurveKeepsDarkAndCompressesBrightTones) {
  for (const double peak : {400.0, 1000.0, 4000.0, 10000.0}) {
    SCOPED_TRACE(peak);
    EXPECT_NEAR(ToneMappedNits(0.0, peak), 0.0, 1e-9);
    EXPECT_NEAR(ToneMappedNits(10.0, peak), 10.0, 0.1);
    EXPECT_NEAR(ToneMappedNits(peak, peak), kHdrWhiteNits, 0.01);
    EXPECT_NEAR(ToneMappedNits(2.0 * peak, peak), kHdrWhiteNits, 0.01);
    double before = -1.0;
    for (double nits = 0.0; nits <= peak; nits += peak / 500.0) {
      const double mapped = ToneMappedNits(nits, peak);
      EXPECT_GT(mapped, before);
      EXPECT_LE(mapped, nits + 1e-6);
      before = mapped;
    }
  }
  EXPECT_NEAR(ToneMappedNits(150.0, 203.0), 150.0, 1e-6);
  EXPECT_NEAR(ToneMappedNits(500.0, 100.0), kHdrWhiteNits, 1e-6);
}

TEST(HdrTones, FilmUsesWholeRange) {
  const HdrTones pq(FilmTransfer::kPq, true, 1000.0);
  EXPECT_NEAR(Mapped(pq, 0.0f), 0.0f, 1e-4);
  EXPECT_NEAR(Mapped(pq, static_cast<float>(PqValue(1000.0))), 1.0f, 2e-3);
  EXPECT_NEAR(Mapped(pq, 1.0f), 1.0f, 1e-4);
  // 10 cd/m2 of 203, as sRGB.
  const double dark = 1.055 * std::pow(10.0 / 203.0, 1.0 / 2.4) - 0.055;
  EXPECT_NEAR(Mapped(pq, static_cast<float>(PqValue(10.0))), dark, 3e-3);
  const float paper = Mapped(pq, static_cast<float>(PqValue(203.0)));
  EXPECT_GT(paper, 0.8f);
  EXPECT_LT(paper, 0.95f);
  const HdrTones hlg(FilmTransfer::kHlg, true, 1000.0);
  EXPECT_NEAR(Mapped(hlg, 0.0f), 0.0f, 1e-4);
  EXPECT_NEAR(Mapped(hlg, 1.0f), 1.0f, 2e-3);
  // BT.2408: paper is 75 % of HLG and 58 % of PQ.
  EXPECT_NEAR(Mapped(hlg, 0.75f), paper, 0.01f);
}

TEST(HdrTones, ConvertsBt2020ToBt709) {
  const HdrTones usual(FilmTransfer::kUsual, true, kUsualPeakNits);
  for (const float value : {0.0f, 0.02f, 0.3f, 0.7f, 1.0f}) {
    EXPECT_NEAR(Mapped(usual, value), value, 1e-3f);
  }
  // BT.709's red by the primaries of BT.2020 (BT.2087, 3): 0.6274, 0.0691, 0.0164 of light.
  const auto srgb = [](double linear) { return 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055; };
  Image red(1, 1, 3);
  red.At(0, 0, 0) = static_cast<float>(srgb(0.6274));
  red.At(1, 0, 0) = static_cast<float>(srgb(0.0691));
  red.At(2, 0, 0) = static_cast<float>(srgb(0.0164));
  usual.Apply(&red);
  EXPECT_NEAR(red.At(0, 0, 0), 1.0f, 2e-3f);
  EXPECT_NEAR(red.At(1, 0, 0), 0.0f, 0.01f);
  EXPECT_NEAR(red.At(2, 0, 0), 0.0f, 0.01f);
  // Colours outside BT.709 are clipped.
  Image wide(2, 1, 3);
  wide.At(1, 0, 0) = 1.0f;
  wide.At(2, 0, 1) = 1.0f;
  HdrTones(FilmTransfer::kPq, true, 1000.0).Apply(&wide);
  for (const float value : wide.data) EXPECT_TRUE(value >= 0.0f && value <= 1.0f);
}

}  // namespace
}  // namespace color3d
