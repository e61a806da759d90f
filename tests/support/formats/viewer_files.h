// Readers of exported files, for tests, of the formats other than PLY, SOG and SPZ (splat_file.h).
// Each takes a whole file and throws std::runtime_error if it violates its format.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "core/base/image.h"
#include "core/base/parallel.h"
#include "core/scene/camera.h"
#include "core/splat/export/viewer_gaussians.h"
#include "core/splat/import/splat_file.h"

namespace color3d {

// Without the rotation of its node.
ViewerGaussians ReadGlb(std::string_view bytes);
// Files of an uncompressed archive, with verified checksums.
std::map<std::string, std::string> ReadStoredZip(std::string_view bytes);

// For each Gaussian of `original`, the index of the one in `file` nearest by position.
std::vector<size_t> PartnersIn(const ViewerGaussians& file, const ViewerGaussians& original);

// The picture of the reference 3DGS renderer over black: 3 channels, 0..1.
Image RenderForViewers(const ViewerGaussians& gaussians,
                       const Camera& camera,
                       const Pose& cam_from_file,
                       ThreadPool& pool);
// Peak 1, over all channels; at most 99 dB.
double PsnrOf(const Image& a, const Image& b);

}  // namespace color3d
