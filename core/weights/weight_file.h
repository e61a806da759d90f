// Reads weight files of all kinds. Never executes code in a file.
#pragma once

#include <filesystem>

#include "core/base/bytes/byte_source.h"
#include "core/weights/safetensors.h"
#include "core/weights/weight_map.h"

namespace color3d {

// Returns all arrays of a weight file as float32, for any stored number format. Detects the kind of
// file by its bytes, not its name. `metadata` (may be null) receives the metadata of a safetensors
// header. Peak memory: the arrays plus about a megabyte.
//
// Throws Error{kInvalidArgument}, naming the file and the reason, if the file is of another kind,
// damaged or hostile (memory is then within a small multiple of its size); kNotFound if it does not
// exist; kDataLoss if it cannot be read.
WeightMap ReadWeightFile(const std::filesystem::path& path, WeightMetadata* metadata = nullptr);
WeightMap ReadWeights(const ByteSource& source, WeightMetadata* metadata = nullptr);

}  // namespace color3d
