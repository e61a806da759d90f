#include "core/metrics/flow_matches.h"

#include "core/base/error.h"
#include "core/image/codec.h"
#include "core/metrics/temporal_consistency.h"

namespace color3d {

std::vector<PixelMatch> MatchByFlow(const Image& luminance,
                                    const Image& other_luminance,
                                    int stride_px) {
  if (stride_px < 1) throw InvalidArgument("the stride of matches is {} px, at least 1", stride_px);
  // Optical flow needs one size.
  const bool same_size =
      luminance.width == other_luminance.width && luminance.height == other_luminance.height;
  const Image other =
      same_size ? other_luminance : Resize(other_luminance, luminance.width, luminance.height);
  const float scale_x = static_cast<float>(other_luminance.width) / luminance.width;
  const float scale_y = static_cast<float>(other_luminance.height) / luminance.height;
  const FollowedPixels followed = FollowToPreviousFrame(luminance, other);
  std::vector<PixelMatch> matches;
  for (int y = 0; y < luminance.height; y += stride_px) {
    for (int x = 0; x < luminance.width; x += stride_px) {
      if (!followed.sure[static_cast<size_t>(y) * luminance.width + x]) continue;
      matches.push_back({x,
                         y,
                         (followed.place.At(0, y, x) + 0.5f) * scale_x,
                         (followed.place.At(1, y, x) + 0.5f) * scale_y});
    }
  }
  return matches;
}

}  // namespace color3d
