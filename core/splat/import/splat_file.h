// Readers of Gaussian splats written by other programs. Every reader checks the sizes that a file
// claims before it allocates memory, and never unpacks more than these sizes. All throw
// Error{kInvalidArgument} with the file's name, the fault and the remedy, and
// Error{kResourceExhausted} if there are more Gaussians than the caller allows. Pure functions,
// thread-safe.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/splat/export/viewer_gaussians.h"

namespace color3d {

struct SplatSource {
  std::string name = "the splat";            // of the file, for messages
  int64_t max_gaussians = 20'000'000;        // more are refused before allocation
  std::string remedy = "thin it out first";  // for too many, continues "; "
};

// PLY of 3D Gaussian splatting, binary little-endian: any order and number types of properties,
// harmonics of degree 0 to 3, or bytes red, green, blue instead. Values are returned as stored:
// they may be infinite or NaN.
ViewerGaussians ReadPly(std::string_view bytes, const SplatSource& source = {});
// SOG version 2, bundled in one zip.
ViewerGaussians ReadSog(std::string_view bytes, const SplatSource& source = {});
// SPZ versions 2 and 3 (gzip) and 4 (zstd), in the axes of 3DGS files (y down, z forward), as for a
// reader that requests RDF.
ViewerGaussians ReadSpz(std::string_view bytes, const SplatSource& source = {});

// Any of these formats, recognized by the first bytes; others are refused with their apparent type.
ViewerGaussians ReadSplat(std::string_view bytes, const SplatSource& source = {});

// Maximum memory per Gaussian of ReadSplat and the conversion of its result, beside the file,
// bytes.
int64_t ReadBytesPerGaussian(int sh_degree);

}  // namespace color3d
