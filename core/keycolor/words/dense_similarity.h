// Similarity of texts to each place of a picture: cosines of CLIP's dense features in overlapping
// windows of several sizes. No torch.
#pragma once

#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/progress.h"
#include "core/encoder/clip/clip.h"

namespace color3d {

// Unit feature of a thing: mean over several sentences about it.
std::vector<float> MeanTextFeature(const TextImageModel& model, const std::string& thing);

// One plane per text, cosines in -1..1, on a grid whose longer side is `map_side_px` (or the
// picture's, if smaller). `texts` are unit vectors. `windows_per_side`: for each entry n, square
// windows of 1/n of the shorter side, half overlapping. Throws Error{kInternal} when the model's
// features and the texts have different lengths.
Image DenseSimilarity(const TextImageModel& model,
                      const Image& srgb,
                      const std::vector<std::vector<float>>& texts,
                      const std::vector<int>& windows_per_side,
                      int map_side_px,
                      ProgressObserver& progress,
                      const CancellationToken& cancel);

}  // namespace color3d
