#include "core/scene/key_photo.h"

#include "core/image/decode_budget.h"
#include "core/image/reduced.h"

namespace color3d {

void RequireKeyViewMemory(const std::string& file, int width, int height, int64_t memory_bytes) {
  // The photo, its luminance, the coloured picture, its copy without alpha and its Lab. For a grey
  // photo this is the minimum for any source of colour.
  constexpr int64_t kBytesPerPixel = 44;
  RequirePictureMemory({file, width, height, kBytesPerPixel * width * height},
                       memory_bytes,
                       "when it is coloured as the key view");
}

Image ReadKeyPhoto(const std::filesystem::path& file, int64_t memory_bytes) {
  return ReadImageResized(file, [&](const PictureSize& own) {
    RequireKeyViewMemory(file.filename().string(), own.width, own.height, memory_bytes);
    return own;
  });
}

}  // namespace color3d
