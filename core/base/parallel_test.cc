#include "core/base/parallel.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "core/base/error.h"

namespace color3d {
namespace {

TEST(ThreadPool, CoversEveryIndexOnceAndRethrows) {
  ThreadPool pool(3);
  std::vector<int> hits(1000, 0);
  pool.ForEach(1000, [&](int64_t i, int) { ++hits[i]; });
  pool.ForRanges(1000, [&](int64_t begin, int64_t end, int) {
    for (int64_t i = begin; i < end; ++i) ++hits[i];
  });
  for (int h : hits) ASSERT_EQ(h, 2);
  EXPECT_THROW(pool.ForEach(100,
                            [](int64_t i, int) {
                              if (i == 57) throw InvalidArgument("x");
                            }),
               Error);
  int64_t sum = 0;
  ThreadPool single(1);
  single.ForEach(10, [&](int64_t i, int) { sum += i; });
  EXPECT_EQ(sum, 45);
}

}  // namespace
}  // namespace color3d
