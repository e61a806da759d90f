// The colour of one view as it is delivered: what was carried, what the personalized colorizer
// infers and what the automatic one guesses, fused (METHOD.md "Fusion of sources"). Thread-safe as
// far as the sources are.
#pragma once

#include <functional>

#include "core/carry/fusion.h"

namespace color3d {

struct InferredColor {
  Image ab;        // 2 channels, Lab units
  Image distance;  // 1 channel: how far from everything that was learnt from; may be empty
};

// Where colours come from beside what was carried.
struct ColorSources {
  // The personalized colorizer. `known`: 1 channel, 1 where the colour is known already.
  std::function<InferredColor(const Image& luminance, const Image& known)> infer;
  // The automatic colorizer, 2 channels. Asked only when enough of a view is strange to the other.
  std::function<Image(const Image& luminance)> guess;
  RelativeChroma relative_chroma;  // of the scene
};

// `luminance`: 1 channel, L 0..100; `carried`: of its size, confidence 0 where nothing was carried.
FusedColor ColorOfView(const Image& luminance,
                       const CarriedColor& carried,
                       const ColorSources& sources,
                       ThreadPool& pool,
                       const CancellationToken& cancel);

}  // namespace color3d
