// Temporal consistency of the colours of a film: CDC and the chroma error along the optical flow
// (METHOD.md "Metrics"), for several colourings of one film at once. Memory does not grow with the
// length of the film.
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

// Histograms of R, G and B over 256 values. Each channel sums to 1.
using ColorHistogram = std::array<std::array<float, 256>, 3>;
// `srgb`: 3 channels, 0..1.
ColorHistogram HistogramOf(const Image& srgb);
// Jensen-Shannon divergence in nats, mean over the three channels: 0 for equal histograms, log 2
// for disjoint ones.
double Divergence(const ColorHistogram& one, const ColorHistogram& other);

// Positions of the pixels of a frame in the frame before.
struct FollowedPixels {
  Image place;             // 2 channels, x and y in px
  std::vector<char> sure;  // forward and backward flow agree, inside the picture
};
// Optical flow of a frame to the frame before. Requires: 1 channel each, L 0..100, equal sizes. No
// pixel is sure in pictures that are too small for optical flow.
FollowedPixels FollowToPreviousFrame(const Image& luminance, const Image& luminance_before);

// Sums over pairs of neighbouring frames. A plain value.
struct ChromaAlongMotion {
  int64_t pixels = 0;       // with reliable flow
  int64_t all_pixels = 0;   // of all pairs
  double difference = 0.0;  // sum of |ab - ab before|, Lab units
  double chroma = 0.0;      // sum of |ab|
  // `ab`: 2 channels of the size of `followed`.
  void Add(const Image& ab, const Image& ab_before, const FollowedPixels& followed);
  void Add(const ChromaAlongMotion& other);
};

inline constexpr std::array<int, 3> kCdcDistances = {1, 2, 4};  // frames

struct TemporalConsistency {
  int pairs = 0;                      // of neighbouring frames
  double followed = 0.0;              // share of their pixels with sure flow, 0..1
  double tc_chroma = 0.0;             // mean |ab - ab before| of these pixels, Lab units
  double chroma = 0.0;                // mean |ab| of these pixels: tc_chroma falls with it
  double cdc = 0.0;                   // mean of cdc_at over the distances that occur
  std::array<double, 3> cdc_at = {};  // by kCdcDistances, nats

  // The metrics by their keys (core/catalogue/metrics.h): "cdc_1" is at a distance of 1 frame.
  std::map<std::string, double> Figures() const;
};

// Frames are identified by any numbers. All pictures of a frame have the same size.
struct TemporalSource {
  // The frames of each shot in the order of time.
  std::vector<std::vector<int>> shots;
  // Luminance of a frame, 1 channel, L 0..100. Called from several threads at once.
  std::function<Image(int frame)> luminance;
  // The frame in each colouring, 3 channels of Lab. Called from several threads at once.
  std::vector<std::function<Image(int frame)>> colorings;
};

// Returns the consistency of each colouring; all 0 if no shot has two frames. Films of more than
// about 250 frames are compared in stretches of 16 frames, evenly spread. Throws Error{kCancelled}
// and the errors of the source.
std::vector<TemporalConsistency> MeasureTemporalConsistency(const TemporalSource& source,
                                                            ThreadPool& pool,
                                                            const CancellationToken& cancel);

}  // namespace color3d
