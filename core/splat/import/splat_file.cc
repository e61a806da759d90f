#include "core/splat/import/splat_file.h"

#include "core/splat/import/read_support.h"

namespace color3d {

ViewerGaussians ReadSplat(std::string_view bytes, const SplatSource& source) {
  constexpr char kPicture[] = "\x89PNG";
  if (bytes.empty()) throw InvalidArgument("{} is empty; copy it again", source.name);
  if (bytes.starts_with("ply")) return ReadPly(bytes, source);
  if (bytes.starts_with("PK")) return ReadSog(bytes, source);
  if (bytes.starts_with("NGSP") || bytes.starts_with("\x1f\x8b")) return ReadSpz(bytes, source);
  const char* looks_like = bytes.starts_with("glTF")       ? " (it is glTF)"
                           : bytes.starts_with(kPicture)   ? " (it is a PNG picture)"
                           : bytes.starts_with("\xff\xd8") ? " (it is a JPEG picture)"
                           : bytes.front() == '{'          ? " (it is JSON)"
                                                           : "";
  throw InvalidArgument(
      "{} is not a readable splat{}; give a .ply of 3D Gaussian splatting, a .sog or a "
      ".spz",
      source.name,
      looks_like);
}

int64_t ReadBytesPerGaussian(int sh_degree) {
  const int64_t coefficients = ShCoefficients(sh_degree);
  const int64_t read = 11 + 3 * coefficients, model = 11 + coefficients;
  return static_cast<int64_t>(sizeof(float)) * (read + model);
}

}  // namespace color3d
