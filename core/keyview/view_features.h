// Features of a view for key view selection: compact, and with the same bytes whether computed or
// cached. Pure values, thread-safe.
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
  // More cells add little information; this bounds the memory of 2000 views.
  static constexpr int kMaxCells = 256;

  std::vector<double> descriptor;  // Encoder::Describe
  FrameContent content;
  int channels = 0;
  // Deep features of up to kMaxCells cells as IEEE half precision, cell after cell, ordered such
  // that every prefix is spread evenly over the picture.
  std::vector<uint16_t> deep;
  std::string thumbnail;  // JPEG of at most kThumbnailSidePx, for display

  int Cells() const { return channels > 0 ? static_cast<int>(deep.size()) / channels : 0; }
  // Keeps only the first `count` cells.
  void KeepCells(int count);
};

// `deep`: features on a coarse grid (Encoder::DeepFeatures); values that are not finite count as 0.
// `seed` chooses the sampled cells. It should be constant for a picture and differ between views,
// so that views do not share a sampling pattern. Throws Error{kInvalidArgument} if `deep` is empty.
ViewFeatures PackViewFeatures(std::vector<double> descriptor,
                              const FrameContent& content,
                              const Image& deep,
                              uint64_t seed);

std::string SerializeViewFeatures(const ViewFeatures& features);
// Returns nothing if the bytes were not written by SerializeViewFeatures.
std::optional<ViewFeatures> ParseViewFeatures(std::string_view bytes);

}  // namespace color3d
