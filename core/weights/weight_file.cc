#include "core/weights/weight_file.h"

namespace color3d {

WeightMap ReadWeightFile(const std::filesystem::path& path, WeightMetadata* metadata) {
  return ReadWeights(FileSource(path), metadata);
}

WeightMap ReadWeights(const ByteSource& source, WeightMetadata* metadata) {
  return ReadSafetensors(source, metadata);
}

}  // namespace color3d
