// Evenly spaced selection from a list. Pure.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace color3d {

// Returns at most the given number of elements, in their order, beginning with the first.
template <class T>
std::vector<T> PickEvenly(std::vector<T> all, size_t most) {
  if (all.size() <= most) return all;
  std::vector<T> kept;
  for (size_t i = 0; i < most; ++i) kept.push_back(std::move(all[i * all.size() / most]));
  return kept;
}

}  // namespace color3d
