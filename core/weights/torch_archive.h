// PyTorch's zip archives: state dicts (.pth, pytorch_model.bin) and TorchScript modules (.pt), read
// without PyTorch and without executing anything in them. For this folder only.
#pragma once

#include "core/weights/byte_source.h"
#include "core/weights/weight_map.h"

namespace color3d {

// A state dict, raw or under "params", "params_ema", "state_dict", "model" or "module"; or the
// parameters and buffers of a TorchScript module, named by their attribute path. Float32 whatever
// the stored type; views become contiguous. Values that are no tensors are left out.
//
// Throws Error{kInvalidArgument} as ReadWeightFile does. All arrays together may take 8 times the
// file's size (an int8 array grows 4 times, and arrays may share a storage), not more.
WeightMap ReadTorchArchive(const ByteSource& source);

}  // namespace color3d
