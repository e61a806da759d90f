#include "client/studio/found_photos.h"

#include <algorithm>
#include <filesystem>

#include "client/lib/photos/gray_copies.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/parallel.h"
#include "core/base/text/utf8.h"
#include "core/catalogue/scene_files.h"
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

// As views are called: relative to images/ or frames/.
std::string ViewName(const LocalFile& photo) {
  for (const std::string_view folder : {std::string_view("images/"), kFramesFolder}) {
    if (photo.path.starts_with(folder)) return photo.path.substr(folder.size());
  }
  return photo.path;
}

const char* KindOf(const PhotoFolder& folder) {
  if (folder.splat) return "splat";
  if (IsFilm(folder)) return "film";
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

bool IsFilm(const PhotoFolder& folder) {
  if (folder.film || folder.photos.empty()) return folder.film.has_value();
  // Frames of several cameras lie in folders of their own.
  const fs::path frame = folder.photos.front().path;
  return frame.parent_path() / "" == fs::path(kFramesFolder);
}

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

SmallPhoto MakeSmallPhoto(const LocalFile& photo, int max_side_px) {
  const Image whole = ReadPhoto(photo);
  const Image small = FitWithin(whole, max_side_px);
  return {EncodePng8(GrayOf(small)), static_cast<double>(small.width) / whole.width};
}

std::string ScaleStrokes(const std::string& strokes, double scale) {
  Json list = Json::parse(strokes, nullptr, /*allow_exceptions=*/false);
  if (!list.is_array()) throw InvalidArgument("the strokes are not a JSON list");
  for (Json& stroke : list) {
    if (!stroke.is_object()) throw InvalidArgument("a stroke is not a JSON object");
    for (const char* length : {"x", "y"}) {
      if (stroke.contains(length) && stroke[length].is_number()) {
        stroke[length] = stroke[length].get<double>() * scale;
      }
    }
    // Defaults of hints.h, so that they are scaled, too; thinner strokes would cover no pixel.
    if (stroke.contains("x"))
      stroke["radius"] = std::max(0.75, stroke.value("radius", 2.0) * scale);
    if (stroke.contains("line"))
      stroke["width"] = std::max(1.5, stroke.value("width", 4.0) * scale);
    for (const char* outline : {"line", "region"}) {
      if (!stroke.contains(outline) || !stroke[outline].is_array()) continue;
      for (Json& point : stroke[outline]) {
        for (Json& value : point) {
          if (value.is_number()) value = value.get<double>() * scale;
        }
      }
    }
  }
  return list.dump();
}

}  // namespace color3d::client
