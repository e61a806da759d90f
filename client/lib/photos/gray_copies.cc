#include "client/lib/photos/gray_copies.h"

#include <algorithm>
#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include "client/lib/photos/photo_color.h"
#include "core/base/files.h"
#include "core/base/parallel.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/image/decode_budget.h"
#include "core/image/reduced.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr int kJpegQuality = 97;
constexpr int kLookSidePx = 64;  // larger than the size at which colour is judged

std::string EncodeGray(const Image& srgb, ImageFormat format) {
  Image gray = LuminanceFromSrgb(srgb);
  for (float& value : gray.data) value = static_cast<float>(GrayFromLuminance(value));
  return format == ImageFormat::kJpeg ? EncodeJpeg(gray, kJpegQuality) : EncodePng16(gray);
}

// Bytes per pixel: the photo, its luminance and the encoded picture.
constexpr int64_t kBytesPerPixel = 40;

}  // namespace

ColorCount CountColorPhotos(const PhotoFolder& folder,
                            int max_photos,
                            const CancellationToken& cancel) {
  ColorCount count;
  count.photos = static_cast<int>(folder.photos.size());
  count.looked_at = std::min(count.photos, max_photos);
  std::atomic<int> in_color{0}, unsure{0};
  ThreadPool pool(2);
  pool.ForEach(count.looked_at, [&](int64_t i, int) {
    cancel.ThrowIfCancelled();
    const LocalFile& photo = folder.photos[i * count.photos / count.looked_at];
    const ColorVerdict verdict = JudgeColor(MeasureHues(ReadImageWithin(photo.file, kLookSidePx)));
    if (verdict.in_color) ++in_color;
    if (!verdict.is_sure) ++unsure;
  });
  count.in_color = in_color;
  count.unsure = unsure;
  return count;
}

namespace {

// The transparency of a PNG or WebP photo as a mask of the scene.
std::optional<LocalFile> SaveAlpha(const std::string& bytes,
                                   const LocalFile& photo,
                                   const fs::path& scratch) {
  const ImageFormat format = ProbeImage(bytes, photo.path).format;
  if (format != ImageFormat::kPng && format != ImageFormat::kWebp) return std::nullopt;
  const Image image = DecodeImage(bytes, photo.path, /*keep_alpha=*/true);
  if (image.channels != 2 && image.channels != 4) return std::nullopt;
  Image mask(image.width, image.height, 1);
  std::copy_n(image.Plane(image.channels - 1), mask.data.size(), mask.data.begin());
  if (std::ranges::all_of(mask.data, [](float a) { return a > 0.5f; })) {
    return std::nullopt;
  }
  const std::string name = photo.path.starts_with("images/") ? photo.path.substr(7) : photo.path;
  const std::string path = "masks/" + name + ".png";
  std::error_code error;
  fs::create_directories((scratch / path).parent_path(), error);
  WriteFileAtomic(scratch / path, EncodePng8(mask));
  return LocalFile{path, scratch / path};
}

}  // namespace

GrayCopies MakeGrayCopies(const PhotoFolder& folder,
                          const fs::path& scratch,
                          const CancellationToken& cancel) {
  GrayCopies copies{folder, {}};
  std::vector<char> in_color(folder.photos.size(), 0);
  // Grey copies have no alpha; masks from the user take precedence anyway.
  std::vector<std::optional<LocalFile>> alpha(folder.photos.size());
  ThreadPool pool(2);
  pool.ForEach(static_cast<int64_t>(folder.photos.size()), [&](int64_t i, int) {
    cancel.ThrowIfCancelled();
    const LocalFile& photo = folder.photos[i];
    const std::string bytes = ReadFile(photo.file);
    const std::string name = photo.file.string();
    const ImageInfo info = ProbeImage(bytes, name);
    const PictureTurn turn(
        {name, info.width, info.height, kBytesPerPixel * info.width * info.height});
    const Image image = DecodeImage(bytes, name);
    if (folder.mask_files.empty()) alpha[i] = SaveAlpha(bytes, photo, scratch);
    in_color[i] = HasColor(image) ? 1 : 0;
    const fs::path copy = scratch / photo.path;
    std::error_code error;
    fs::create_directories(copy.parent_path(), error);
    WriteFileAtomic(copy, EncodeGray(image, info.format));
    copies.folder.photos[i].file = copy;
  });
  for (const std::optional<LocalFile>& mask : alpha) {
    if (mask) copies.folder.mask_files.push_back(*mask);
  }
  for (size_t i = 0; i < in_color.size(); ++i) {
    if (in_color[i] != 0) copies.in_color.insert(folder.photos[i].path);
  }
  return copies;
}

}  // namespace color3d::client
