#include "core/carry/plane_sweep_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "core/base/random.h"
#include "core/simd/instruction_set.h"

namespace color3d {
namespace {

constexpr int kUnknownCost = 11;

Image RandomImage(int width, int height, Random& random) {
  Image image(width, height, 1);
  for (float& value : image.data) value = 100.0f * random.NextUniform();
  return image;
}

float Clamped(const Image& image, int y, int x) {
  return image.At(0, std::clamp(y, 0, image.height - 1), std::clamp(x, 0, image.width - 1));
}

// Pixels of the windows around (x, y) that are darker than the centre in one picture only.
int Differing(const Image& a, const Image& b, int y, int x) {
  int count = 0;
  for (int dy = -kCensusRadius; dy <= kCensusRadius; ++dy) {
    for (int dx = -kCensusRadius; dx <= kCensusRadius; ++dx) {
      if ((dx + dy) % 2 != 0) continue;
      count += (Clamped(a, y + dy, x + dx) < a.At(0, y, x)) !=
               (Clamped(b, y + dy, x + dx) < b.At(0, y, x));
    }
  }
  return count;
}

// The source seen by a reference that looks (3, 1) pixels further; 0 beyond its borders.
Image Shifted(const Image& source, int width, int height) {
  Image warped(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool inside = x + 3 < source.width && y + 1 < source.height;
      warped.At(0, y, x) = source.At(0, inside ? y + 1 : 0, inside ? x + 3 : 0);
    }
  }
  return warped;
}

TEST(MatchSource, CountsCensusBitsForEveryInstructionSet) {
  Random random(5, 0);
  const Image reference = RandomImage(37, 11, random), source = RandomImage(33, 12, random);
  Image mask(37, 11, 1, 1.0f), source_mask(33, 12, 1, 1.0f);
  mask.At(0, 4, 20) = 0.0f;
  source_mask.At(0, 6, 10) = 0.0f;
  const Image warped = Shifted(source, 37, 11);
  for (const std::string& set : SupportedInstructionSets()) {
    LimitInstructionSet(set);
    const CensusImage census = CensusOf(reference, mask);
    std::vector<uint8_t> costs;
    MatchSource(census, source, source_mask, {1, 0, 3, 0, 1, 1, 0, 0, 1}, &costs);
    for (int y = 0; y < reference.height; ++y) {
      for (int x = 0; x < reference.width; ++x) {
        const bool inside = x + 3 < source.width && y + 1 < source.height;
        const bool known = inside && mask.At(0, y, x) > 0.0f && source_mask.At(0, y + 1, x + 3) > 0;
        EXPECT_EQ(costs[static_cast<size_t>(y) * census.stride + x],
                  known ? Differing(reference, warped, y, x) : kUnknownCost)
            << set << " " << x << " " << y;
      }
    }
  }
  LimitInstructionSet("");
}

TEST(MeanOfSmallest, TakesSmallestCostsForEveryInstructionSet) {
  Random random(6, 0);
  std::vector<std::vector<uint8_t>> costs(5, std::vector<uint8_t>(700));
  for (auto& of_source : costs) {
    for (uint8_t& cost : of_source) cost = static_cast<uint8_t>(random.NextBelow(25));
  }
  for (const std::string& set : SupportedInstructionSets()) {
    LimitInstructionSet(set);
    std::vector<uint8_t> mean;
    MeanOfSmallest(costs, 3, &mean);
    for (size_t i = 0; i < mean.size(); ++i) {
      std::vector<int> sorted;
      for (const auto& of_source : costs) sorted.push_back(of_source[i]);
      std::ranges::sort(sorted);
      EXPECT_EQ(mean[i], (sorted[0] + sorted[1] + sorted[2]) * kCostScale / 3) << set;
    }
  }
  LimitInstructionSet("");
}

}  // namespace
}  // namespace color3d
