#include "client/studio/found_photos.h"

#include <algorithm>
#include <filesystem>

#include "client/lib/photos/gray_copies.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/parallel.h"
#include "core/base/text/utf8.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/image/decode_budget.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;
constexpr size_t kMostHeaders = 400;
constexpr int kPhotosOfColor = 12;  // looked at for colour
constexpr int kJpegQuality = 90;
constexpr int64_t kBytesPerPhotoPixel = 40;

// As views are called: relative to images/.
std::string ViewName(const LocalFile& photo) {
  return photo.path.starts_with("images/") ? photo.path.substr(7) : photo.path;
}

const char* KindOf(const PhotoFolder& folder) {
  if (folder.splat) return "splat";
  if (folder.film) return "film";
  return folder.camera_films.empty() ? "photos" : "films";
}

Json DescribePhoto(const LocalFile& photo) {
  Json json = {{"name", ViewName(photo)}, {"width", 0}, {"height", 0}};
  try {
    const ImageInfo info = ProbeImage(ReadFile(photo.file), ViewName(photo));
    json["width"] = info.width;
    json["height"] = info.height;
  } catch (const Error& e) {
    json["problem"] = e.what();
  }
  return json;
}

Image ReadPhoto(const LocalFile& photo) {
  const std::string bytes = ReadFile(photo.file);
  const std::string name = ViewName(photo);
  const ImageInfo info = ProbeImage(bytes, name);
  const PictureTurn turn(
      {name, info.width, info.height, kBytesPerPhotoPixel * info.width * info.height});
  return DecodeImage(bytes, name);
}

Image GrayOf(const Image& photo) {
  if (photo.channels != 3) return photo;
  Image gray = LuminanceFromSrgb(photo);
  for (float& value : gray.data) value = static_cast<float>(GrayFromLuminance(value));
  return gray;
}

}  // namespace

Json DescribePhotos(const PhotoFolder& folder, const CancellationToken& cancel) {
  int64_t bytes = 0;
  for (const LocalFile& file : folder.AllFiles()) {
    std::error_code none;
    const auto size = fs::file_size(file.file, none);
    if (!none) bytes += static_cast<int64_t>(size);
  }
  std::vector<Json> photos(folder.photos.size());
  const bool reads_all = photos.size() <= kMostHeaders;
  ThreadPool pool(2);
  pool.ForEach(static_cast<int64_t>(photos.size()), [&](int64_t i, int) {
    cancel.ThrowIfCancelled();
    photos[i] = reads_all ? DescribePhoto(folder.photos[i])
                          : Json::object({{"name", ViewName(folder.photos[i])}});
  });
  Json notes = folder.notes;
  Json in_color;
  bool is_whole = true;
  for (const Json& photo : photos) is_whole = is_whole && !photo.contains("problem");
  if (!photos.empty() && is_whole) {
    try {
      const ColorCount count = CountColorPhotos(folder, kPhotosOfColor, cancel);
      if (count.IsSure()) in_color = count.MostlyColor();
    } catch (const Error& e) {
      if (e.code() == ErrorCode::kCancelled) throw;
      notes.push_back(e.what());
    }
  }
  return {{"kind", KindOf(folder)},
          {"name", folder.Name()},
          {"bytes", bytes},
          {"has_poses", !folder.model_files.empty()},
          {"in_color", in_color},
          {"notes", notes},
          {"photos", photos}};
}

v1::CaptureFacts CaptureFactsOf(const PhotoFolder& folder) {
  v1::CaptureFacts capture;
  capture.set_layout(static_cast<v1::Scene::Layout>(folder.Layout()));
  capture.set_photo_count(static_cast<int>(folder.photos.size()));
  capture.set_augment_file_count(static_cast<int>(folder.augment_files.size()));
  return capture;
}

const LocalFile& PhotoOfView(const PhotoFolder& folder, const std::string& name) {
  const auto stem = [](const std::string& path) { return fs::path(path).replace_extension(); };
  for (const LocalFile& photo : folder.photos) {
    if (ViewName(photo) == name) return photo;
  }
  for (const LocalFile& photo : folder.photos) {
    if (stem(ViewName(photo)) == stem(name)) return photo;
  }
  throw Error(ErrorCode::kNotFound, "there is no photo {}", EscapeControls(CleanUtf8(name, 200)));
}

std::string PhotoJpeg(const LocalFile& photo, int max_side_px, bool gray) {
  const Image image = FitWithin(ReadPhoto(photo), max_side_px);
  return EncodeJpeg(gray ? GrayOf(image) : image, kJpegQuality);
}

}  // namespace color3d::client
