// Readers of the files that the export writes for viewers, for tests. PLY,
// SOG and SPZ are the product's own (splat_file.h), the rest is here: each takes whole files and
// throws std::runtime_error where one is not as its format says.
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

// Without its node's turn.
ViewerGaussians ReadGlb(std::string_view bytes);
// The files of an archive without compression, checked against their checksums.
std::map<std::string, std::string> ReadStoredZip(std::string_view bytes);

// Which Gaussian of `file` each of `original` became: the nearest by position.
std::vector<size_t> PartnersIn(const ViewerGaussians& file, const ViewerGaussians& original);

// The picture of the reference 3DGS renderer over black: 3 channels, 0..1.
Image RenderForViewers(const ViewerGaussians& gaussians,
                       const Camera& camera,
                       const Pose& cam_from_file,
                       ThreadPool& pool);
// Peak 1, over all channels; at most 99 dB.
double PsnrOf(const Image& a, const Image& b);

}  // namespace color3d
