#include "core/splat/export/sog/codebook.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/base/random.h"

namespace color3d {
namespace {

std::vector<float> Normal(size_t count, uint64_t seed) {
  Random random(seed);
  std::vector<float> values(count);
  for (float& v : values) v = static_cast<float>(random.NextNormal());
  return values;
}

TEST(CodebookTest, KeepsFewValuesAndApproximatesMany) {
  const Codebook few({3.0f, -1.0f, 3.0f, 0.5f});
  for (const float v : {3.0f, -1.0f, 0.5f}) EXPECT_EQ(few.levels()[few.Nearest(v)], v);
  EXPECT_EQ(Codebook({}).levels()[7], 0.0f);

  const std::vector<float> values = Normal(30000, 1);
  const Codebook many(values);
  EXPECT_TRUE(std::is_sorted(many.levels().begin(), many.levels().end()));
  double squares = 0.0;
  for (const float v : values) {
    const float got = many.levels()[many.Nearest(v)];
    squares += (v - got) * (v - got);
    for (const float level : many.levels())
      EXPECT_LE(std::abs(v - got), std::abs(v - level) + 1e-6);
    if (testing::Test::HasFailure()) return;
  }
  // The minimum error of 256 levels for a normal distribution is sqrt(3) pi / 2 / 256^2.
  EXPECT_LT(squares / values.size(), 1.15 * std::sqrt(3.0) * M_PI / 2.0 / 65536.0);
}

TEST(PaletteTest, FindsClustersForAnyThreadCount) {
  constexpr int kWidth = 5;
  const std::vector<float> centers = Normal(40 * kWidth, 2);
  std::vector<float> rows;
  for (size_t i = 0; i < 2000; ++i) {
    const float* center = centers.data() + i % 40 * kWidth;
    rows.insert(rows.end(), center, center + kWidth);
  }
  ThreadPool one(1), two(2);
  const Palette palette = MakePalette(rows, kWidth, 128, one);
  const Palette again = MakePalette(rows, kWidth, 128, two);
  EXPECT_EQ(palette.rows, again.rows);
  EXPECT_EQ(palette.labels, again.labels);
  ASSERT_EQ(palette.rows.size(), 128u * kWidth);
  ASSERT_EQ(palette.labels.size(), 2000u);
  for (size_t i = 0; i < 2000; ++i) {
    for (int k = 0; k < kWidth; ++k) {
      EXPECT_NEAR(palette.rows[palette.labels[i] * kWidth + k], rows[i * kWidth + k], 1e-5);
    }
  }
}

TEST(PaletteTest, ErrorFallsWithPaletteSize) {
  ThreadPool pool(2);
  const std::vector<float> rows = Normal(4000 * 4, 3);
  double last = 1e30;
  for (const int size : {1, 16, 256, 4096}) {
    const Palette palette = MakePalette(rows, 4, size, pool);
    double squares = 0.0;
    for (size_t i = 0; i < rows.size(); ++i) {
      const double d = rows[i] - palette.rows[palette.labels[i / 4] * 4 + i % 4];
      squares += d * d;
    }
    EXPECT_LT(squares, 0.5 * last) << size;
    last = squares;
  }
  EXPECT_TRUE(MakePalette({}, 3, 2, pool).labels.empty());
  const Palette single = MakePalette({1.0f, 2.0f, 3.0f}, 3, 1, pool);
  EXPECT_EQ(single.rows, (std::vector<float>{1.0f, 2.0f, 3.0f}));
}

}  // namespace
}  // namespace color3d
