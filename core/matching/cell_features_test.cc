#include "core/matching/cell_features.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include <algorithm>
#include <vector>

namespace color3d {
namespace {

ConvNextConfig TwoTaps() {
  ConvNextConfig config;
  config.stem_stride = 2;
  config.dims = {1, 1, 1};
  return config;
}

TEST(CellFeaturesTest, BorderCellsIgnorePadding) {
  // 6 x 5 px: two by two cells, of which three are cut.
  const torch::Tensor l = torch::arange(30, torch::kFloat32).view({1, 1, 5, 6});
  const torch::Tensor means = CellMeans(l);
  ASSERT_EQ(means.sizes(), (std::vector<int64_t>{4, 1}));
  EXPECT_FLOAT_EQ(means[1][0].item<float>(), l.slice(2, 0, 4).slice(3, 4, 6).mean().item<float>());
  EXPECT_FLOAT_EQ(means[3][0].item<float>(), 0.5f * (28.0f + 29.0f));
}

TEST(CellFeaturesTest, CropsTapsToPicture) {
  const torch::Tensor l = torch::full({1, 1, 6, 10}, 50.0f);
  // Of the picture padded to 16 x 16; what lies beyond it must not be seen.
  std::vector<torch::Tensor> taps = {torch::full({1, 1, 8, 8}, 1.0f),
                                     torch::full({1, 1, 4, 4}, 2.0f),
                                     torch::full({1, 1, 2, 2}, 3.0f)};
  taps[0].slice(2, 3, 8).fill_(99.0f);
  taps[0].slice(3, 5, 8).fill_(99.0f);
  taps[1].slice(2, 2, 4).fill_(99.0f);
  taps[2].slice(2, 1, 2).fill_(99.0f);
  const CellFeatures cells = DescribeCells(TwoTaps(), taps, l);
  EXPECT_EQ(cells.rows, 2);
  EXPECT_EQ(cells.columns, 3);
  ASSERT_EQ(cells.blocks.size(), 4u);
  for (int k = 0; k < 3; ++k) {
    EXPECT_TRUE(torch::allclose(cells.blocks[k], torch::full({6, 1}, 1.0f + k))) << k;
  }
  EXPECT_EQ(cells.blocks[3].size(1), kLuminanceStatistics);
  EXPECT_NEAR(cells.blocks[3][5][0].item<float>(), 0.5f, 1e-6f);
}

TEST(CellFeaturesTest, DrawsRowsWithoutRepetition) {
  Random random(3);
  const torch::Tensor rows = SampleRows(50, 20, random);
  ASSERT_EQ(rows.size(0), 20);
  std::vector<int64_t> sorted(rows.data_ptr<int64_t>(), rows.data_ptr<int64_t>() + 20);
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(std::adjacent_find(sorted.begin(), sorted.end()), sorted.end());
  EXPECT_LT(sorted.back(), 50);
  EXPECT_EQ(SampleRows(5, 20, random).size(0), 5);
}

}  // namespace
}  // namespace color3d
