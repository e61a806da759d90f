#include "client/lib/photos/gray_copies.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/base/files.h"
#include "core/base/parallel.h"
#include "core/color/lab.h"
#include "core/image/codec.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr int kJpegQuality = 97;
constexpr int kChromaSidePx = 160;
constexpr int kLuminanceBins = 16;
// Toned film measures 0.7..1.0, scenes in colour 7.6 and more.
constexpr double kMinFreeChroma = 2.0;

std::string EncodeGray(const Image& srgb, ImageFormat format) {
  Image gray = LuminanceFromSrgb(srgb);
  for (float& value : gray.data) value = static_cast<float>(GrayFromLuminance(value));
  return format == ImageFormat::kJpeg ? EncodeJpeg(gray, kJpegQuality) : EncodePng16(gray);
}

// First and second moments of the chroma of pixels of like luminance.
struct ChromaBin {
  double count = 0.0;
  double a = 0.0;
  double b = 0.0;
  double square = 0.0;
};

}  // namespace

double FreeChroma(const Image& srgb) {
  if (srgb.channels != 3 || srgb.Empty()) return 0.0;
  const Image lab = LabFromSrgb(FitWithin(srgb, kChromaSidePx));
  std::array<ChromaBin, kLuminanceBins> bins;
  for (size_t i = 0; i < lab.PlaneSize(); ++i) {
    const int index = static_cast<int>(lab.Plane(0)[i] / 100.0f * kLuminanceBins);
    ChromaBin& bin = bins[std::clamp(index, 0, kLuminanceBins - 1)];
    const double a = lab.Plane(1)[i];
    const double b = lab.Plane(2)[i];
    bin.count += 1.0;
    bin.a += a;
    bin.b += b;
    bin.square += a * a + b * b;
  }
  double sum = 0.0;
  for (const ChromaBin& bin : bins) {
    if (bin.count > 0.0) sum += bin.square - (bin.a * bin.a + bin.b * bin.b) / bin.count;
  }
  return std::sqrt(std::max(0.0, sum) / static_cast<double>(lab.PlaneSize()));
}

bool HasColor(const Image& srgb) { return FreeChroma(srgb) >= kMinFreeChroma; }

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
  if (std::all_of(mask.data.begin(), mask.data.end(), [](float a) { return a > 0.5f; })) {
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
  // Grey copies have no alpha; where the user gives masks, they win anyway.
  std::vector<std::optional<LocalFile>> alpha(folder.photos.size());
  ThreadPool pool(2);
  pool.ForEach(static_cast<int64_t>(folder.photos.size()), [&](int64_t i, int) {
    cancel.ThrowIfCancelled();
    const LocalFile& photo = folder.photos[i];
    const std::string bytes = ReadFile(photo.file);
    const std::string name = photo.file.string();
    const Image image = DecodeImage(bytes, name);
    if (folder.mask_files.empty()) alpha[i] = SaveAlpha(bytes, photo, scratch);
    in_color[i] = HasColor(image) ? 1 : 0;
    const fs::path copy = scratch / photo.path;
    std::error_code error;
    fs::create_directories(copy.parent_path(), error);
    WriteFileAtomic(copy, EncodeGray(image, ProbeImage(bytes, name).format));
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
