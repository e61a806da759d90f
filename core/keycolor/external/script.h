// Colouring by the user's own TorchScript file.
#pragma once

#include <filesystem>

#include "core/base/image.h"

namespace color3d {

struct ScriptColor {
  Image ab;  // 2 channels, Lab units, size of the luminance
  // Mean |dL| of an answer in sRGB to the photo, whose own L is kept; 0 of an answer in ab.
  double luminance_deviation = 0.0;
};

// Loads `torchscript` (made with torch.jit.script or trace and .save, on CPU) and calls its forward
// once with a float32 tensor [1,1,H,W]: L in 0..100 of the photo, longer side at most 1024 px, its
// right and bottom borders repeated until H and W are multiples of 32. It must return one tensor
// (or a tuple or list that begins with one), either
//   [1,2,h,w]  a, b in Lab units, or
//   [1,3,h,w]  sRGB in 0..1,
// of any size that covers the padded input; it is brought to the photo's size along the edges of
// its L.
// A TorchScript file is a program: whoever names one here has its code run with the rights of this
// process, and no time limit but the caller's. Take files only from people you trust.
// Throws Error{kInvalidArgument} naming the file and what came: a file that cannot be loaded or
// raises, another shape or type, values that are not finite or out of range (|a|, |b| > 150, sRGB
// beyond -0.1..1.1).
ScriptColor KeyColorFromScript(const Image& luminance, const std::filesystem::path& torchscript);

}  // namespace color3d
