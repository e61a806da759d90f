// Options of the stage colorize_views.
#pragma once

#include "core/stage/options/working_size.h"

namespace color3d {

struct ColorizeViewsOptions {
  // Source of the colours (METHOD.md "Baselines").
  enum class Method {
    kFusion,            // carried, else inferred, else guessed
    kPersonalized,      // inferred by the colorizer of the scene
    kNearestNeighbors,  // in feature space, without decoder and positions
    kDecoder,           // without neighbours
    kCarried,           // grey where nothing was carried
    kAutomatic,         // each view by itself
    kFlow,              // propagated by optical flow from view to view
    kGray,
  };
  int max_side_px = 500;  // 64..4096
  Method method = Method::kFusion;
  bool full_size = false;  // infer at the size of the views, even if training pictures are smaller
  bool guess = true;       // kFusion: automatic guesses where nothing similar has a colour
  bool spread = true;      // kFusion: spread colours between the edges of the luminance

  void Validate() const { CheckMaxSide(max_side_px); }
  // True if the method reads the scene's colorizer.
  bool NeedsColorizer() const {
    return method == Method::kFusion || method == Method::kPersonalized ||
           method == Method::kNearestNeighbors || method == Method::kDecoder;
  }
  bool operator==(const ColorizeViewsOptions&) const = default;
};

}  // namespace color3d
