#include "client/lib/gray_copies.h"

#include <algorithm>
#include <atomic>
#include <vector>

#include "core/base/files.h"
#include "core/base/parallel.h"
#include "core/color/lab.h"
#include "core/image/codec.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr int kJpegQuality = 97;

bool HasColor(const Image& image) { return image.channels == 3 && !IsGray(image); }

std::string EncodeGray(const Image& srgb, ImageFormat format) {
  Image gray = LuminanceFromSrgb(srgb);
  for (float& value : gray.data) value = static_cast<float>(GrayFromLuminance(value));
  return format == ImageFormat::kJpeg ? EncodeJpeg(gray, kJpegQuality) : EncodePng16(gray);
}

}  // namespace

ColorCount CountColorPhotos(const PhotoFolder& folder,
                            int max_photos,
                            const CancellationToken& cancel) {
  ColorCount count;
  count.photos = static_cast<int>(folder.photos.size());
  count.looked_at = std::min(count.photos, max_photos);
  std::atomic<int> in_color{0};
  ThreadPool pool(2);
  pool.ForEach(count.looked_at, [&](int64_t i, int) {
    cancel.ThrowIfCancelled();
    const LocalFile& photo = folder.photos[i * count.photos / count.looked_at];
    if (HasColor(ReadImage(photo.file))) ++in_color;
  });
  count.in_color = in_color;
  return count;
}

GrayCopies MakeGrayCopies(const PhotoFolder& folder,
                          const fs::path& scratch,
                          const CancellationToken& cancel) {
  GrayCopies copies{folder, {}};
  std::vector<char> in_color(folder.photos.size(), 0);
  ThreadPool pool(2);
  pool.ForEach(static_cast<int64_t>(folder.photos.size()), [&](int64_t i, int) {
    cancel.ThrowIfCancelled();
    const LocalFile& photo = folder.photos[i];
    const std::string bytes = ReadFile(photo.file);
    const std::string name = photo.file.string();
    const Image image = DecodeImage(bytes, name);
    in_color[i] = HasColor(image) ? 1 : 0;
    const fs::path copy = scratch / photo.path;
    std::error_code error;
    fs::create_directories(copy.parent_path(), error);
    WriteFileAtomic(copy, EncodeGray(image, ProbeImage(bytes, name).format));
    copies.folder.photos[i].file = copy;
  });
  for (size_t i = 0; i < in_color.size(); ++i) {
    if (in_color[i] != 0) copies.in_color.insert(folder.photos[i].path);
  }
  return copies;
}

}  // namespace color3d::client
