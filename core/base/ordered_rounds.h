// A parallel loop whose results are used in order.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/parallel.h"

namespace color3d {

// Calls use(i, make(i)) for i in [0, count), in order and on the calling thread. make is called on
// the threads of `pool`, for as many i at once as it has threads, so that no more results are in
// memory. Null: on the calling thread. Results are default-constructible and movable. Rethrows the
// first exception.
template <class Make, class Use>
void ForOrdered(ThreadPool* pool, int64_t count, const Make& make, const Use& use) {
  if (pool == nullptr) {
    for (int64_t i = 0; i < count; ++i) use(i, make(i));
    return;
  }
  const int64_t round = pool->thread_count();
  std::vector<decltype(make(int64_t{0}))> results(static_cast<size_t>(round));
  for (int64_t first = 0; first < count; first += round) {
    const int64_t in_round = std::min(round, count - first);
    pool->ForEach(in_round, [&](int64_t k, int) { results[k] = make(first + k); });
    for (int64_t k = 0; k < in_round; ++k) use(first + k, std::move(results[k]));
  }
}

}  // namespace color3d
