#include "core/weights/weight_file.h"

#include <algorithm>
#include <new>
#include <string>

#include "core/weights/torch_archive.h"

namespace color3d {

WeightMap ReadWeightFile(const std::filesystem::path& path, WeightMetadata* metadata) {
  return ReadWeights(FileSource(path), metadata);
}

WeightMap ReadWeights(const ByteSource& source, WeightMetadata* metadata) {
  const std::string head = source.ReadString(0, std::min<uint64_t>(source.size(), 16));
  try {
    if (head.starts_with("PK\x03\x04")) return ReadTorchArchive(source);
    if (head.size() > 8 && head[8] == '{') return ReadSafetensors(source, metadata);
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::kResourceExhausted,
                source.Refusal("not enough memory for its arrays").what());
  }
  // Format of torch.save before version 1.6: a pickle that starts with a magic number of 10 bytes.
  if (head.starts_with("\x80\x02\x8a\x0a")) {
    throw source.Refusal(
        "it was saved by PyTorch before 1.6 (no zip archive); convert it with python -c \"import "
        "torch; torch.save(torch.load('old.pth', map_location='cpu'), 'new.pth')\"");
  }
  throw source.Refusal(
      "not a weight file of a supported kind: safetensors, a PyTorch state dict (.pth, .bin) or "
      "TorchScript (.pt)");
}

}  // namespace color3d
