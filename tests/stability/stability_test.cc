// Runs the fast cases, and checks that the comparison can fail.
#include <gtest/gtest.h>

#include <cctype>
#include <cmath>

#include "core/base/files.h"
#include "core/base/random.h"
#include "tests/stability/raster_compare.h"
#include "tests/stability/stability_case.h"
#include "tests/stability/stability_table.h"

namespace color3d {
namespace {

std::string CommittedTable() {
  return ReadFile(std::filesystem::path(COLOR3D_STABILITY_FOLDER) / kStabilityTable);
}

std::string FullName(const StabilityCase& c) { return c.group + ", " + c.name; }

std::vector<StabilityCase> FastCases() {
  std::vector<StabilityCase> cases = StabilityCases();
  std::erase_if(cases, [](const StabilityCase& c) { return c.slow; });
  return cases;
}

class StabilityTest : public testing::TestWithParam<StabilityCase> {};

TEST_P(StabilityTest, IsFiniteAndWithinBounds) {
  ThreadPool pool(2);
  const StabilityResult result = RunStabilityCase(GetParam(), pool);
  EXPECT_TRUE(result.held) << result.outcome;
  EXPECT_EQ(result.non_finite, 0);
  EXPECT_TRUE(result.Passed()) << "value " << result.value_error << " of " << result.value_bound
                               << ", gradient " << result.gradient_error << " of "
                               << result.gradient_bound;
  EXPECT_EQ(BoundsOfCase(CommittedTable(), FullName(GetParam())), PrintedBounds(result))
      << "make " << kStabilityTable << " again";
}

TEST(StabilityTableTest, CommittedTableHasEveryCaseAndItsDigest) {
  const std::string table = CommittedTable();
  std::vector<std::string> names;
  for (const StabilityCase& c : StabilityCases()) names.push_back(FullName(c));
  EXPECT_EQ(CasesOfMarkdown(table), names) << "make " << kStabilityTable << " again";
  EXPECT_EQ(StatedDigest(table), DigestOfRows(table)) << "edited by hand";
  EXPECT_EQ(table.find("FAILED"), std::string::npos);
}

TEST(StabilityTableTest, DigestChangesWithCasesAndBounds) {
  StabilityRow row{{"raster", "needle", false, {}}, {}};
  row.result.value_error = 1e-7;
  row.result.value_bound = 1e-6;
  const std::string before = DigestOfRows(StabilityMarkdown({row}));
  EXPECT_EQ(StatedDigest(StabilityMarkdown({row})), before);
  row.result.value_error = 2e-7;  // depends on the machine
  row.result.outcome = "a|b";
  EXPECT_EQ(DigestOfRows(StabilityMarkdown({row})), before);
  row.result.value_bound = 1e-5;
  EXPECT_NE(DigestOfRows(StabilityMarkdown({row})), before);
  EXPECT_EQ(CasesOfMarkdown(StabilityMarkdown({row})), std::vector<std::string>{"raster, needle"});
}

INSTANTIATE_TEST_SUITE_P(Cases,
                         StabilityTest,
                         testing::ValuesIn(FastCases()),
                         [](const testing::TestParamInfo<StabilityCase>& info) {
                           std::string name = info.param.group + "_" + info.param.name;
                           for (char& c : name) {
                             if (c == '-') c = 'm';  // distinguishes 1e-8 from 1e8
                             if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
                           }
                           return name;
                         });

// Twelve Gaussians in front of a turned camera, with all spherical harmonics.
RasterCase SmallCase() {
  RasterCase r;
  r.camera.width = 20;
  r.camera.height = 14;
  r.camera.fx = r.camera.fy = 18.0f;
  r.camera.cx = 9.0f;
  r.camera.cy = 7.5f;
  const float c = std::cos(0.4f), s = std::sin(0.4f);
  const float rotation[9] = {c, 0, s, 0, 1, 0, -s, 0, c};
  std::copy(rotation, rotation + 9, r.camera.rotation);
  r.color.channel[0].coefficients = 16;
  Random random(3);
  r.parameters = ParameterBlock(kColorRow + 16, 12);
  for (int row = 0; row < r.parameters.rows(); ++row) {
    for (int i = 0; i < 12; ++i) {
      const double centre = row == 2 ? 2.5 : row >= kLogScaleRow && row < kRotationRow ? -2.0 : 0.0;
      const double spread = row < kColorRow ? 0.6 : 0.1;
      r.parameters.Row(row)[i] =
          static_cast<float>(random.NextUniform(centre - spread, centre + spread));
    }
  }
  return r;
}

TEST(ReferenceTest, GradientAgreesWithFiniteDifferences) {
  const RasterCase r = SmallCase();
  ReferenceParameters p = ReferenceParameters::From(r.parameters);
  const std::vector<double> background = {0.2};
  std::vector<ReferencePixel> pixels;
  std::vector<std::array<double, 3>> weights;
  Random random(8);
  for (int k = 0; k < 20 * 14; ++k) {
    pixels.emplace_back();
    pixels.back().x = k % 20;
    pixels.back().y = k / 20;
  }
  ReferenceRenderAt(p, r.color, r.camera, background, 1e-3, pixels);
  std::erase_if(pixels, [](const ReferencePixel& pixel) { return pixel.near_threshold; });
  for (size_t k = 0; k < pixels.size(); ++k) weights.push_back({random.NextUniform(-1.0, 1.0)});
  ASSERT_GT(pixels.size(), 200u);
  const ReferenceParameters gradient =
      ReferenceGradient(p, r.color, r.camera, background, pixels, weights);
  const auto sum = [&] {
    ReferenceRenderAt(p, r.color, r.camera, background, 0.0, pixels);
    double total = 0.0;
    for (size_t k = 0; k < pixels.size(); ++k) total += weights[k][0] * pixels[k].color[0];
    return total;
  };
  for (int row = 0; row < p.rows; ++row) {
    for (int i = 0; i < p.count; ++i) {
      const double saved = p.At(row, i), h = 1e-6;
      p.At(row, i) = saved + h;
      const double above = sum();
      p.At(row, i) = saved - h;
      const double below = sum();
      p.At(row, i) = saved;
      EXPECT_NEAR(gradient.At(row, i), (above - below) / (2.0 * h), 1e-6) << row << " " << i;
    }
  }
}

TEST(CompareRasterTest, FindsWrongValueAndGradient) {
  ThreadPool pool(2);
  RasterCase r = SmallCase();
  EXPECT_TRUE(CompareRaster(r, pool).Passed());
  r.truth = ReferenceParameters::From(r.parameters);
  r.truth->At(kPositionRow, 5) += 1e-3;
  const StabilityResult result = CompareRaster(r, pool);
  EXPECT_FALSE(result.Passed());
  EXPECT_GT(result.value_error, result.value_bound);
  EXPECT_GT(result.gradient_error, result.gradient_bound);
}

TEST(CompareRasterTest, CountsNonFiniteValues) {
  ThreadPool pool(2);
  RasterCase r = SmallCase();
  r.parameters.Row(kColorRow)[3] = std::numeric_limits<float>::infinity();
  r.truth = ReferenceParameters::From(SmallCase().parameters);
  const StabilityResult result = CompareRaster(r, pool);
  EXPECT_GT(result.non_finite, 0);
  EXPECT_FALSE(result.Passed());
}

}  // namespace
}  // namespace color3d
