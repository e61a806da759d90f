// Aligned float storage of the numeric kernels. Plain values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

namespace color3d {

template <class T>
struct CacheLineAllocator {
  using value_type = T;
  CacheLineAllocator() = default;
  template <class U>
  // NOLINTNEXTLINE(google-explicit-constructor): allocators convert into each other
  CacheLineAllocator(const CacheLineAllocator<U>&) {}
  T* allocate(size_t n) {
    return static_cast<T*>(::operator new (n * sizeof(T), std::align_val_t{64}));
  }
  void deallocate(T* p, size_t) { ::operator delete (p, std::align_val_t{64}); }
  bool operator==(const CacheLineAllocator&) const { return true; }
};
using AlignedFloats = std::vector<float, CacheLineAllocator<float>>;

// Planar picture whose rows and height are padded to multiples of 16 (whole tiles, whole vectors).
// The padding is never read as pixels.
struct PlaneBuffer {
  int width = 0;
  int height = 0;
  int channels = 0;
  int stride = 0;         // floats from row to row
  int padded_height = 0;  // rows per channel
  AlignedFloats data;

  PlaneBuffer() = default;
  PlaneBuffer(int width_px, int height_px, int channel_count) {
    Reset(width_px, height_px, channel_count);
  }
  // Keeps the contents when the shape is the same; all zeros otherwise.
  void Reset(int width_px, int height_px, int channel_count) {
    if (width == width_px && height == height_px && channels == channel_count) return;
    width = width_px;
    height = height_px;
    channels = channel_count;
    stride = (width + 15) / 16 * 16;
    padded_height = (height + 15) / 16 * 16;
    data.assign(static_cast<size_t>(stride) * padded_height * channels, 0.0f);
  }
  float* Row(int channel, int y) {
    return data.data() + (static_cast<size_t>(channel) * padded_height + y) * stride;
  }
  const float* Row(int channel, int y) const {
    return data.data() + (static_cast<size_t>(channel) * padded_height + y) * stride;
  }
};

}  // namespace color3d
