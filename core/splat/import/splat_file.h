// Reading Gaussian splats that other programs have written. Every reader checks what a file says of
// its sizes before it takes memory for them, and never unpacks more than those sizes. All throw
// Error{kInvalidArgument} that names the file, what is wrong with it and what to do, and
// Error{kResourceExhausted} where there are more Gaussians than the caller can bear. Pure
// functions, thread-safe.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/splat/export/viewer_gaussians.h"

namespace color3d {

struct SplatSource {
  std::string name = "the splat";            // of the file, for complaints
  int64_t max_gaussians = 20'000'000;        // more are refused before memory is taken for them
  std::string remedy = "thin it out first";  // for too many, continues "; "
};

// PLY of 3D Gaussian splatting, binary little-endian: any order and number types of properties,
// harmonics of degree 0 to 3, or bytes red, green, blue in place of them. Values are as they stand
// there: they may be infinite or not a number.
ViewerGaussians ReadPly(std::string_view bytes, const SplatSource& source = {});
// SOG of version 2, bundled in one zip.
ViewerGaussians ReadSog(std::string_view bytes, const SplatSource& source = {});
// SPZ of versions 2 and 3 (gzip) and 4 (zstd), in the axes of 3DGS files (y down, z forward), as a
// reader is told that asks for RDF.
ViewerGaussians ReadSpz(std::string_view bytes, const SplatSource& source = {});

// Any of them, told by the first bytes; others are refused by what they look like.
ViewerGaussians ReadSplat(std::string_view bytes, const SplatSource& source = {});

// What ReadSplat and what is made of it take at the most for each Gaussian, beside the file, bytes.
int64_t ReadBytesPerGaussian(int sh_degree);

}  // namespace color3d
