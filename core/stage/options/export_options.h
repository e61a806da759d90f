// Options of the stage export.
#pragma once

namespace color3d {

struct ExportOptions {
  bool ply = true;      // 3DGS with RGB spherical harmonics
  bool sog = true;      // the same in a tenth of the bytes, for web viewers
  bool spz = false;     // a byte or two for each number
  int spz_version = 4;  // 4, or 2 for older readers
  bool glb = false;     // glTF with KHR_gaussian_splatting
  bool splat = false;   // 32 bytes a Gaussian, no view dependence
  bool splat4d = true;  // of a scene that moves: all of its moments, for web players
  // PLY with a property "confidence", which strict viewers may refuse; needs a model that has it.
  bool confidence = false;
  // Of a scene that moves: PLYs of so many moments, evenly over its time, 0..1000.
  int moments = 0;
  void Validate() const;
  bool operator==(const ExportOptions&) const = default;
};

}  // namespace color3d
