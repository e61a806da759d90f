// Are the colours of a film steady? CDC and the chroma error along motion (METHOD.md "Metrics"), of
// several colourings of one film at once, in memory that does not grow with its length.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/parallel.h"

namespace color3d {

// How often each of 256 values of R, G and B occurs in a picture; each channel sums to 1.
using ColorHistogram = std::array<std::array<float, 256>, 3>;
// `srgb`: 3 channels, 0..1.
ColorHistogram HistogramOf(const Image& srgb);
// Jensen-Shannon divergence in nats, mean of the three channels: 0 the same, log 2 nothing in
// common.
double Divergence(const ColorHistogram& one, const ColorHistogram& other);

// Where the pixels of a frame were in the frame before.
struct FollowedPixels {
  Image place;             // 2 channels, x and y in px
  std::vector<char> sure;  // flow there and back agrees, inside of the picture
};
// Both 1 channel, L 0..100, of one size. Nothing is sure where pictures are too small for flow.
FollowedPixels FollowBack(const Image& luminance, const Image& luminance_before);

// A plain value; sums over pairs of neighbouring frames.
struct ChromaAlongMotion {
  int64_t pixels = 0;       // that were followed surely
  int64_t all_pixels = 0;   // of the pairs
  double difference = 0.0;  // sum of |ab - ab before|, Lab units
  double chroma = 0.0;      // sum of |ab|
  // `ab`: 2 channels of the size of `followed`.
  void Add(const Image& ab, const Image& ab_before, const FollowedPixels& followed);
  void Add(const ChromaAlongMotion& other);
};

inline constexpr std::array<int, 3> kCdcDistances = {1, 2, 4};  // frames

struct TemporalConsistency {
  int pairs = 0;                      // of neighbouring frames
  double followed = 0.0;              // share of their pixels that were followed surely, 0..1
  double tc_chroma = 0.0;             // mean |ab - ab before| of these, Lab units
  double chroma = 0.0;                // mean |ab| of these: where it is small, so is tc_chroma
  double cdc = 0.0;                   // mean of cdc_at, of the distances that there are
  std::array<double, 3> cdc_at = {};  // by kCdcDistances, nats

  // The metrics by their keys (core/catalogue/metrics.h): "cdc_1" is at a distance of 1 frame.
  std::map<std::string, double> Figures() const;
};

// Frames are numbered as the source likes; all pictures of a frame have one size.
struct TemporalSource {
  // The frames of each shot in the order of time.
  std::vector<std::vector<int>> shots;
  // Called from several threads at once. 1 channel, L 0..100 ...
  std::function<Image(int frame)> luminance;
  // ... and the frame in each colouring, 3 channels of Lab.
  std::vector<std::function<Image(int frame)>> colorings;
};

// Of each colouring. Of films with more than some 250 frames stretches of 16 are compared, evenly
// spread. All 0 without a shot of two frames. Throws Error{kCancelled} and what the source throws.
std::vector<TemporalConsistency> MeasureTemporalConsistency(const TemporalSource& source,
                                                            ThreadPool& pool,
                                                            const CancellationToken& cancel);

}  // namespace color3d
