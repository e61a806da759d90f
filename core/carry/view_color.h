// The final colour of a view: carried, inferred and guessed colours fused (STILL.md "Fusion of
// sources"). As thread-safe as the sources.
#pragma once

#include <functional>

#include "core/carry/fusion.h"

namespace color3d {

struct InferredColor {
  Image ab;        // 2 channels, Lab units
  Image distance;  // 1 channel: feature distance from the training pictures; may be empty
};

// Sources of colour beside the carried ones.
struct ColorSources {
  // The personalized colorizer. `known`: 1 channel, 1 where the colour is known already.
  std::function<InferredColor(const Image& luminance, const Image& known)> infer;
  // The automatic colorizer, 2 channels. Called only when enough of a view is far from the training
  // pictures.
  std::function<Image(const Image& luminance)> guess;
  RelativeChroma relative_chroma;  // of the scene
  bool spread = true;              // as FusionOptions::spread
};

// `luminance`: 1 channel, L 0..100. `carried`: of the same size; confidence 0 where nothing was
// carried.
FusedColor FuseViewColor(const Image& luminance,
                         const CarriedColor& carried,
                         const ColorSources& sources,
                         ThreadPool& pool,
                         const CancellationToken& cancel);

}  // namespace color3d
