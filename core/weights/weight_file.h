// One door to all weight files. Reads only: no code in a file is ever executed.
#pragma once

#include <filesystem>

#include "core/weights/byte_source.h"
#include "core/weights/safetensors.h"
#include "core/weights/weight_map.h"

namespace color3d {

// All arrays of a weight file as float32, whatever the stored number format; the kind of file is
// told from its bytes, not from its name. `metadata` (may be null) gets what a safetensors header
// carries. Peak memory: the arrays and about a megabyte.
//
// Throws Error{kInvalidArgument}, naming the file and the reason, when the file is of another kind,
// damaged or hostile (memory then stays within a small multiple of its size); kNotFound when there
// is none; kDataLoss when it cannot be read.
WeightMap ReadWeightFile(const std::filesystem::path& path, WeightMetadata* metadata = nullptr);
WeightMap ReadWeights(const ByteSource& source, WeightMetadata* metadata = nullptr);

}  // namespace color3d
