// What key view selection knows of one view: small, packed, and the same bytes whether it was
// computed now or comes from a cache. Pure values, thread-safe.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/image.h"
#include "core/keyview/frame_content.h"

namespace color3d {

inline constexpr int kThumbnailSidePx = 260;

struct ViewFeatures {
  // More cells tell hardly more; fewer keep 2000 views small.
  static constexpr int kMaxCells = 256;

  std::vector<double> descriptor;  // Encoder::Describe
  FrameContent content;
  int channels = 0;
  // Deep features of up to kMaxCells cells as IEEE half precision, cell after cell. The cells come
  // in an order in which every beginning is spread evenly over the picture.
  std::vector<uint16_t> deep;
  std::string thumbnail;  // JPEG of at most kThumbnailSidePx, for people

  int Cells() const { return channels > 0 ? static_cast<int>(deep.size()) / channels : 0; }
  // Drops all cells but the first `count`.
  void KeepCells(int count);
};

// `deep`: features on a coarse grid (Encoder::DeepFeatures); values that are not finite count as 0.
// `seed` places the sampled cells: the same for the same picture, else a sampling pattern would be
// shared by all views. Throws Error{kInvalidArgument} when `deep` is empty.
ViewFeatures PackViewFeatures(std::vector<double> descriptor,
                              const FrameContent& content,
                              const Image& deep,
                              uint64_t seed);

std::string SerializeViewFeatures(const ViewFeatures& features);
// Nothing when the bytes are not what SerializeViewFeatures wrote.
std::optional<ViewFeatures> ParseViewFeatures(std::string_view bytes);

}  // namespace color3d
