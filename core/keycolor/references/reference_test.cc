#include "core/keycolor/references/reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"

namespace color3d {
namespace {

struct Recorder : NullObserver {
  void OnWarning(const std::string& message) override { warning = message; }
  std::string warning;
};

// Three bands, each with a texture and a colour of its own; `shift` moves them.
Image Bands(int width, int height, int shift) {
  Image lab(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int band = (x + shift) * 3 / width % 3;
      const auto u = static_cast<float>(x + shift), v = static_cast<float>(y + shift);
      const float texture = band == 0   ? 12.0f * std::sin(0.9f * u) * std::sin(0.9f * v)
                            : band == 1 ? 10.0f * std::sin(0.35f * (u + v))
                                        : 0.0f;
      lab.At(0, y, x) = (band == 0 ? 40.0f : band == 1 ? 55.0f : 80.0f) + texture;
      lab.At(1, y, x) = band == 0 ? -25.0f : band == 1 ? 30.0f : 0.0f;
      lab.At(2, y, x) = band == 0 ? 20.0f : band == 1 ? 15.0f : -20.0f;
    }
  }
  return lab;
}

// Fine vertical stripes of strong contrast, unlike all of Bands.
Image Stripes(int width, int height) {
  Image lab(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      lab.At(0, y, x) = x % 2 == 0 ? 20.0f : 70.0f;
      lab.At(1, y, x) = 20.0f;
    }
  }
  return lab;
}

ReferenceSolution Solve(const Image& luminance,
                        const std::vector<Image>& references,
                        const ReferenceOptions& options,
                        Recorder& recorder,
                        int threads = 0,
                        const CancellationToken& cancel = {}) {
  ThreadPool pool(threads);
  NoCheckpoints none;
  return KeyColorFromReferences(
      luminance, references, *Encoder::Embedded(), options, {pool, none, recorder, cancel});
}

double MeanError(const Image& ab, const Image& lab) {
  double sum = 0.0;
  for (size_t i = 0; i < ab.PlaneSize(); ++i) {
    sum += std::hypot(ab.Plane(0)[i] - lab.Plane(1)[i], ab.Plane(1)[i] - lab.Plane(2)[i]);
  }
  return sum / static_cast<double>(ab.PlaneSize());
}

TEST(ReferenceTest, TransfersColorsByTexture) {
  const Image key = Bands(360, 160, 120);
  Recorder recorder;
  const ReferenceSolution solution =
      Solve(LuminanceOfLab(key), {SrgbFromLab(Bands(420, 180, 0))}, {}, recorder);
  ASSERT_EQ(solution.ab.width, 360);
  ASSERT_EQ(solution.ab.height, 160);
  const double gray = MeanError(Image(360, 160, 2), key);
  EXPECT_LT(MeanError(solution.ab, key), 0.35 * gray);
  EXPECT_EQ(recorder.warning, "");
  for (float value : solution.confidence.data) {
    ASSERT_GE(value, 0.0f);
    ASSERT_LE(value, 1.0f);
  }
}

TEST(ReferenceTest, PrefersSimilarReference) {
  const Image key = Bands(360, 160, 120);
  Recorder recorder;
  const ReferenceSolution solution =
      Solve(LuminanceOfLab(key),
            {SrgbFromLab(Stripes(64, 64)), SrgbFromLab(Bands(420, 180, 0))},
            {},
            recorder);
  ASSERT_EQ(solution.explained.size(), 2u);
  EXPECT_NEAR(solution.explained[0] + solution.explained[1], 1.0, 1e-9);
  EXPECT_GT(solution.explained[1], 0.7);
}

TEST(ReferenceTest, WarnsAndFadesUnrelatedReferences) {
  const Image key = Bands(360, 160, 120);
  ReferenceOptions options;
  options.low_confidence = 1.0;  // no match is that certain
  Recorder recorder;
  const ReferenceSolution solution =
      Solve(LuminanceOfLab(key), {SrgbFromLab(Stripes(64, 64))}, options, recorder);
  EXPECT_NE(recorder.warning.find("mean confidence"), std::string::npos) << recorder.warning;
  for (float value : solution.ab.data) ASSERT_LE(std::abs(value), 20.0f * 0.9f);
}

TEST(ReferenceTest, GivesSameBytesForAnyThreadCount) {
  const Image key = Bands(100, 70, 40);
  const std::vector<Image> references{SrgbFromLab(Bands(100, 70, 0))};
  std::vector<float> first;
  for (int threads : {1, 3}) {
    Recorder recorder;
    const ReferenceSolution solution =
        Solve(LuminanceOfLab(key), references, {}, recorder, threads);
    if (first.empty()) first = solution.ab.data;
    EXPECT_EQ(first, solution.ab.data);
  }
}

TEST(ReferenceTest, NamesRefusedReferences) {
  const Image luminance = LuminanceOfLab(Bands(100, 70, 0));
  const Image good = SrgbFromLab(Bands(100, 70, 0));
  const auto message_of = [&](const std::vector<Image>& references) -> std::string {
    Recorder recorder;
    try {
      Solve(luminance, references, {}, recorder);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message_of({}).find("at least one"), std::string::npos);
  EXPECT_NE(message_of({good, Image(64, 64, 1)}).find("picture 1 has no colour"),
            std::string::npos);
  EXPECT_NE(message_of({good, Image(64, 64, 3, 0.5f)}).find("picture 1 has no colour"),
            std::string::npos);
  EXPECT_NE(message_of({Image(15, 64, 3, 0.5f)}).find("15x64"), std::string::npos);
  CancellationToken cancel;
  cancel.Cancel();
  Recorder recorder;
  EXPECT_THROW(Solve(luminance, {good}, {}, recorder, 0, cancel), Error);
}

}  // namespace
}  // namespace color3d
