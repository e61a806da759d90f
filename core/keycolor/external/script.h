// Colours the key view by a TorchScript file of the user.
#pragma once

#include <filesystem>

#include "core/base/image.h"

namespace color3d {

struct ScriptColor {
  Image ab;  // 2 channels, Lab units, size of the luminance
  // Mean |dL| between an answer in sRGB and the photo, whose L is kept; 0 for answers in ab.
  double luminance_deviation = 0.0;
};

// Loads `torchscript` (made with torch.jit.script or trace and .save, on CPU) and calls its forward
// once with a float32 tensor [1,1,H,W]: L in 0..100 of the photo, longer side at most 1024 px, its
// right and bottom borders repeated until H and W are multiples of 32. It must return one tensor
// (or a tuple or list that begins with one), either
//   [1,2,h,w]  a, b in Lab units, or
//   [1,3,h,w]  sRGB in 0..1,
// of any size that covers the padded input; it is resampled to the photo's size, guided by its L.
// Security: a TorchScript file is a program. It runs with the rights of this process, and no time
// limit but the caller's. Use files from trusted sources only.
// Throws Error{kInvalidArgument} naming the file and the fault: it cannot be loaded or raises an
// exception, or it returns another shape or type, or values that are not finite or out of range
// (|a|, |b| > 150, sRGB beyond -0.1..1.1).
ScriptColor KeyColorFromScript(const Image& luminance, const std::filesystem::path& torchscript);

}  // namespace color3d
