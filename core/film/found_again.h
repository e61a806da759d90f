// Places of a key frame that are found again in a frame far from it by local features, where steps
// from frame to frame lost them: behind something that passed, or in a jump too wide for flow.
#pragma once

#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/image/local_features.h"

namespace color3d {

// Both ways between a key frame and another: 2 channels, x and y in px.
struct FilmTrack {
  Image in_key;    // where each pixel of the frame lies in the key frame
  Image in_frame;  // where each pixel of the key frame lies in the frame
};

class FoundAgain {
 public:
  // `key`: L in 0..100, 1 channel; must outlive the object.
  explicit FoundAgain(const Image& key);

  const Image& key() const { return key_; }
  // What the frame may show of the key frame, each as one plane moves and flow around it (DIS); the
  // plane that most features agree on first. None where features do not agree. Thread-safe.
  std::vector<FilmTrack> TracksTo(const Image& frame, const CancellationToken& cancel) const;

 private:
  const Image& key_;
  LocalFeatures features_;
};

}  // namespace color3d
