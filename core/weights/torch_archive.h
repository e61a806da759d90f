// PyTorch's zip archives: state dicts (.pth, pytorch_model.bin) and TorchScript modules (.pt), read
// without PyTorch and without executing anything in them. For this folder only.
#pragma once

#include "core/base/bytes/byte_source.h"
#include "core/weights/weight_map.h"

namespace color3d {

// Reads a state dict, top-level or under "params", "params_ema", "state_dict", "model" or "module";
// or the parameters and buffers of a TorchScript module, named by attribute path. All become
// contiguous float32. Values other than tensors are ignored.
//
// Throws Error{kInvalidArgument} as ReadWeightFile does. All arrays together may take at most 8
// times the size of the file (an int8 array grows 4 times, and arrays may share a storage).
WeightMap ReadTorchArchive(const ByteSource& source);

}  // namespace color3d
