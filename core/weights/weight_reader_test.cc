#include "core/weights/weight_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "core/base/error.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

WeightArray Ones(std::vector<int64_t> shape, size_t count) {
  return {std::move(shape), std::vector<float>(count, 1.0f)};
}

TEST(WeightReaderTest, TakesMatchingArraysWithoutCopy) {
  WeightMap weights{{"a", Ones({2, 2}, 4)}, {"b.num_batches_tracked", Ones({}, 1)}};
  const float* memory = weights.at("a").values.data();
  WeightReader reader(std::move(weights), "the test weights");
  EXPECT_TRUE(reader.Has("a"));
  EXPECT_EQ(reader.ShapeOf("a"), (std::vector<int64_t>{2, 2}));
  EXPECT_EQ(reader.Take("a", {2, 2}).values.data(), memory);
  reader.Ignore(".num_batches_tracked");
  EXPECT_NO_THROW(reader.Finish());
}

TEST(WeightReaderTest, ReportsAllProblemsInOneMessage) {
  WeightMap weights{{"fits", Ones({1}, 1)},
                    {"misshapen", Ones({2, 3}, 6)},
                    {"nan", Ones({1}, 1)},
                    {"old.head", Ones({5}, 5)}};
  weights["nan"].values[0] = std::numeric_limits<float>::quiet_NaN();
  for (int i = 0; i < 12; ++i) weights["extra" + std::to_string(i)] = Ones({1}, 1);
  WeightReader reader(std::move(weights), "the test weights");
  reader.IgnorePrefix("old.");
  reader.Take("fits", {1});
  EXPECT_EQ(reader.Take("misshapen", {3, 2}).values.size(), 6u);
  EXPECT_EQ(reader.Take("missing", {4}).values, std::vector<float>(4, 0.0f));
  reader.Take("nan", {1});
  try {
    reader.Finish();
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(error.what(), HasSubstr("the test weights do not fit"));
    EXPECT_THAT(error.what(), HasSubstr("1 missing: \"missing\" [4]"));
    EXPECT_THAT(error.what(),
                HasSubstr("1 of another shape: \"misshapen\" is [2,3], expected [3,2]"));
    EXPECT_THAT(error.what(), HasSubstr("12 unexpected: \"extra0\" [1], "));
    EXPECT_THAT(error.what(), HasSubstr(", ..."));
    EXPECT_THAT(error.what(), HasSubstr("not finite: \"nan\""));
    EXPECT_THAT(error.what(), Not(HasSubstr("old.head")));
  }
}

// A hostile file with one long vector makes a network expect a matrix of its square.
TEST(WeightReaderTest, BoundsMemoryForMissingArrays) {
  WeightReader reader({{"norm", Ones({1000}, 1000)}}, "the test weights");
  reader.Take("norm", {1000});
  EXPECT_THROW(reader.Take("linear", {int64_t{1} << 40, int64_t{1} << 40}), Error);
  EXPECT_THROW(reader.Take("linear", {-1}), Error);
  EXPECT_THROW(
      {
        for (int i = 0; i < 100; ++i) reader.Take("linear" + std::to_string(i), {1 << 20});
      },
      Error);
}

}  // namespace
}  // namespace color3d
