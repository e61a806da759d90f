#include "core/splat/model/parameter_block.h"

#include <algorithm>

namespace color3d {
namespace {

// An odd number of cache lines, so that the same Gaussian's rows fall into different cache sets.
int64_t StrideFor(int64_t count) {
  const int64_t lines = std::max<int64_t>(1, (count + 15) / 16);
  return (lines | 1) * 16;
}

}  // namespace

void ParameterBlock::Resize(int64_t count) {
  const int64_t stride = StrideFor(count);
  AlignedFloats values(static_cast<size_t>(stride) * rows_, 0.0f);
  const int64_t kept = std::min(count, count_);
  for (int r = 0; r < rows_; ++r) {
    std::copy_n(values_.data() + r * stride_, kept, values.data() + r * stride);
  }
  values_.swap(values);
  count_ = count;
  stride_ = stride;
}

void ParameterBlock::SetZero() { std::fill(values_.begin(), values_.end(), 0.0f); }

void ParameterBlock::Gather(const std::vector<uint32_t>& source) {
  const int64_t count = static_cast<int64_t>(source.size());
  const int64_t stride = StrideFor(count);
  AlignedFloats values(static_cast<size_t>(stride) * rows_, 0.0f);
  for (int r = 0; r < rows_; ++r) {
    const float* from = Row(r);
    float* to = values.data() + r * stride;
    for (int64_t i = 0; i < count; ++i) to[i] = from[source[i]];
  }
  values_.swap(values);
  count_ = count;
  stride_ = stride;
}

void ParameterBlock::CopyGaussian(int64_t from, int64_t to) {
  for (int r = 0; r < rows_; ++r) Row(r)[to] = Row(r)[from];
}

}  // namespace color3d
