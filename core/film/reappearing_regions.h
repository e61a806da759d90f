// Finds regions of a key frame by local features in frames where tracking by flow lost them: behind
// an occlusion, or after a jump too wide for flow.
#pragma once

#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/image/local_features.h"

namespace color3d {

// Correspondences between a key frame and another frame: 2 channels, x and y in px.
struct FilmTrack {
  Image in_key;    // place in the key frame of each pixel of the frame
  Image in_frame;  // place in the frame of each pixel of the key frame
};

class ReappearingRegions {
 public:
  // `key`: L in 0..100, 1 channel; must outlive the object.
  explicit ReappearingRegions(const Image& key);

  const Image& key() const { return key_; }
  // Candidate tracks: each is a homography refined by optical flow (DIS), those with most features
  // first. Empty when features do not agree. Thread-safe.
  std::vector<FilmTrack> TracksTo(const Image& frame, const CancellationToken& cancel) const;

 private:
  const Image& key_;
  LocalFeatures features_;
};

}  // namespace color3d
