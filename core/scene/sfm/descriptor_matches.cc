#include "core/scene/sfm/descriptor_matches.h"

#include <algorithm>
#include <cmath>

// Compiled for processors with and without AVX2; sanitizers do not support the dispatch.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define COLOR3D_DISPATCHED __attribute__((target_clones("avx2", "default")))
#else
#define COLOR3D_DISPATCHED
#endif

namespace color3d {
namespace {

constexpr int kDimensions = SiftDescriptors::kDimensions;
constexpr int kBlock = 64;  // rows: 16 KiB, which fit in the L1 cache

// Scalar products of one row with `count` rows.
COLOR3D_DISPATCHED void Products(const int16_t* row,
                                 const int16_t* rows,
                                 int count,
                                 int32_t* products) {
  for (int j = 0; j < count; ++j) {
    const int16_t* other = rows + int64_t{j} * kDimensions;
    int32_t sum = 0;
    for (int k = 0; k < kDimensions; ++k) sum += int32_t{row[k]} * other[k];
    products[j] = sum;
  }
}

// The largest and second largest product in a row or column.
struct Nearest {
  int index = -1;
  int32_t best = 0;
  int32_t second = 0;

  void Offer(int i, int32_t product) {
    if (product <= second) return;
    if (product > best) {
      second = best;
      best = product;
      index = i;
    } else {
      second = product;
    }
  }
  bool IsClear() const {
    constexpr double kMaxAngle = 0.7, kMaxRatio = 0.8;
    const double angle = AngleOf(best);
    return index >= 0 && angle <= kMaxAngle && angle < kMaxRatio * AngleOf(second);
  }
  // Descriptors have the length 512, up to rounding.
  static double AngleOf(int32_t product) {
    constexpr double kLength = 512.0;
    return std::acos(std::min(product / (kLength * kLength), 1.0));
  }
};

}  // namespace

SiftDescriptors::SiftDescriptors(std::string_view bytes) {
  values_.resize(bytes.size() / kDimensions * kDimensions);
  for (size_t i = 0; i < values_.size(); ++i) values_[i] = static_cast<uint8_t>(bytes[i]);
}

std::vector<std::pair<int, int>> MatchDescriptors(const SiftDescriptors& a,
                                                  const SiftDescriptors& b) {
  std::vector<Nearest> of_a(static_cast<size_t>(a.count())), of_b(static_cast<size_t>(b.count()));
  int32_t products[kBlock];
  for (int begin = 0; begin < b.count(); begin += kBlock) {
    const int count = std::min(kBlock, b.count() - begin);
    for (int i = 0; i < a.count(); ++i) {
      Products(a.Row(i), b.Row(begin), count, products);
      for (int j = 0; j < count; ++j) {
        of_a[i].Offer(begin + j, products[j]);
        of_b[begin + j].Offer(i, products[j]);
      }
    }
  }
  std::vector<std::pair<int, int>> matches;
  for (int i = 0; i < a.count(); ++i) {
    if (!of_a[i].IsClear()) continue;
    const Nearest& back = of_b[of_a[i].index];
    if (back.index == i && back.IsClear()) matches.emplace_back(i, of_a[i].index);
  }
  return matches;
}

}  // namespace color3d
