#include "core/base/parallel.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/ordered_rounds.h"

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

TEST(ForOrdered, UsesResultsInOrderAndRethrows) {
  ThreadPool pool(3);
  for (ThreadPool* helpers : {static_cast<ThreadPool*>(nullptr), &pool}) {
    std::vector<int64_t> seen;
    ForOrdered(
        helpers,
        8,
        [](int64_t i) { return 10 * i; },
        [&](int64_t i, int64_t result) {
          EXPECT_EQ(result, 10 * i);
          seen.push_back(i);
        });
    EXPECT_EQ(seen, (std::vector<int64_t>{0, 1, 2, 3, 4, 5, 6, 7}));
    const auto fail = [](int64_t i) {
      if (i == 5) throw InvalidArgument("x");
      return i;
    };
    EXPECT_THROW(ForOrdered(helpers, 8, fail, [](int64_t, int64_t) {}), Error);
  }
}

}  // namespace
}  // namespace color3d
