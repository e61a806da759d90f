// Encoders for benchmarks.
#pragma once

#include <memory>
#include <string>

#include "core/encoder/tap_encoder.h"

namespace color3d {

// "embedded", "random" (the same network before training), "squeezenet=FILE.onnx", or a weight
// file: one of ours ("encoder.*", as `pretrain` writes it) or a published one. Throws
// Error{kInvalidArgument} for other names.
std::shared_ptr<const Encoder> BenchEncoder(const std::string& name);

}  // namespace color3d
