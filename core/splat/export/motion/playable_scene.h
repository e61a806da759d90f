// A scene that moves, as the page plays it: all of its Gaussians as SOG, and their motion. Pure
// functions.
#pragma once

#include <string>
#include <vector>

#include "core/base/parallel.h"
#include "core/splat/export/viewer_gaussians.h"

namespace color3d {

struct PlayableScene {
  std::string sog;                // each Gaussian in the middle of its window of time
  std::string motion;             // EncodeMotion, in the order of the SOG
  std::vector<float> confidence;  // of colours, in this order; empty if unknown
};

// Returns true if the model moves by windows of time. A deformation field has no such windows.
bool IsPlayable(const GaussianModel& model);

// The Gaussians that reach half a step of 255 of opacity at some time of the scene; smaller ones
// would vanish in the SOG. Requires IsPlayable.
GaussianModel EverSeen(const GaussianModel& model);

// `rgb`: colours of the Gaussians. Requires IsPlayable. Throws as EncodeSog and EncodeMotion.
PlayableScene EncodePlayable(const GaussianModel& model,
                             const RgbHarmonics& rgb,
                             const ExportFrame& frame,
                             ThreadPool& pool);

}  // namespace color3d
