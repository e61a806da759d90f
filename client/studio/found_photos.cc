#include "client/studio/found_photos.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "client/lib/photos/gray_copies.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/parallel.h"
#include "core/base/text/utf8.h"
#include "core/catalogue/scene_files.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/image/decode_budget.h"
#include "core/image/reduced.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;
constexpr size_t kMostHeaders = 400;
constexpr int kPhotosOfColor = 12;  // looked at for colour
constexpr int kJpegQuality = 90;
constexpr int64_t kBytesPerPhotoPixel = 40;
constexpr int64_t kLargePixels = 60'000'000;
constexpr int kEnoughSidePx = 6000;
constexpr size_t kManyPhotos = 300;
constexpr size_t kNamed = 3;  // of odd photos

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

std::string NameSome(const std::vector<std::string>& names) {
  const std::vector<std::string> first(names.begin(),
                                       names.begin() + std::min(names.size(), kNamed));
  const std::string list = fmt::format("{}", fmt::join(first, ", "));
  return names.size() > kNamed ? fmt::format("{} and {} more", list, names.size() - kNamed) : list;
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
  for (const std::string& note : SizeNotes(photos)) notes.push_back(note);
  if (photos.size() > kManyPhotos) {
    notes.push_back(fmt::format(
        "{} photos take long; 10 to 50 of one place are enough, so bring a part of them",
        photos.size()));
  }
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

std::vector<std::string> SizeNotes(const Json& photos) {
  std::map<std::pair<int, int>, std::vector<std::string>> sizes;
  size_t known = 0;
  for (const Json& photo : photos) {
    const std::pair<int, int> size(photo.value("width", 0), photo.value("height", 0));
    if (size.first == 0) continue;
    sizes[size].push_back(photo.value("name", ""));
    ++known;
  }
  std::vector<std::string> notes;
  const auto most =
      std::ranges::max_element(sizes, {}, [](const auto& size) { return size.second.size(); });
  for (const auto& [size, names] : sizes) {
    const auto [width, height] = size;
    const std::string list = NameSome(names);
    if (static_cast<int64_t>(width) * height >= kLargePixels) {
      notes.push_back(fmt::format(
          "{}: {} x {} px, which takes much memory and time; {} px on the longer side are enough",
          list,
          width,
          height,
          kEnoughSidePx));
    } else if (known >= 3 && 2 * most->second.size() > known && size != most->first) {
      notes.push_back(fmt::format("{}: {} x {} px, unlike most of the photos ({} x {} px)",
                                  list,
                                  width,
                                  height,
                                  most->first.first,
                                  most->first.second));
    }
  }
  return notes;
}

PhotoFolder CollectSet(const PhotoSet& set) {
  const auto by_name = [&](std::string text) {
    const std::string path = set.folder.string();
    for (size_t at; (at = text.find(path)) != text.npos;) text.replace(at, path.size(), set.name);
    return text;
  };
  try {
    PhotoFolder folder = CollectPhotos(set.folder, set.as_frames);
    if (set.as_frames) UsePhotosAsFrames(&folder);
    for (std::string& note : folder.notes) note = by_name(note);
    return folder;
  } catch (const Error& e) {
    if (!set.is_own) throw;  // the user's own folder: its path helps
    throw Error(e.code(), "{}", by_name(e.what()));
  }
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
  if (max_side_px <= 0) return PictureJpeg(ReadPhoto(photo), 0, gray, kJpegQuality);
  // Of a large scan only the small picture is held as floats.
  const Image small = DecodeImageWithin(ReadFile(photo.file), ViewName(photo), max_side_px);
  return PictureJpeg(small, 0, gray, kJpegQuality);
}

std::string PictureJpeg(const Image& picture, int max_side_px, bool gray, int quality) {
  const Image small = FitWithin(picture, max_side_px);
  return EncodeJpeg(gray ? GrayOf(small) : small, quality);
}

}  // namespace color3d::client
