#include "core/scene/photo_masks.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>

#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/base/text/lower_case.h"
#include "core/image/codec.h"
#include "core/scene/named_files.h"
#include "core/scene/photos.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr char kFolder[] = "masks/";
constexpr const char* kPhotoFolders[] = {"images/", "input/", ""};
constexpr float kWhole = 0.999f;  // coverage of a reduced pixel

// Candidate paths of the mask of a photo, best first.
std::vector<std::string> MaskNames(const std::string& photo_file) {
  std::vector<std::string> names;
  for (const std::string folder : kPhotoFolders) {
    if (!photo_file.starts_with(folder)) continue;
    const std::string name = photo_file.substr(folder.size());
    names.push_back(kFolder + name + ".png");
    names.push_back(kFolder + fs::path(name).replace_extension(".png").generic_string());
  }
  return names;
}

bool HasTransparency(const fs::path& file, const std::string& name) {
  const std::string bytes = ReadFile(file);
  const ImageInfo info = ProbeImage(bytes, name);
  if (info.format != ImageFormat::kPng && info.format != ImageFormat::kWebp) return false;
  // Transparency of palettes, and of one colour in other pictures, is in a chunk of its own;
  // without it there is nothing to decode.
  const bool has_alpha = info.channels == 2 || info.channels == 4;
  if (!has_alpha && bytes.find("tRNS") == std::string::npos) return false;
  const Image image = DecodeImage(bytes, name, /*keep_alpha=*/true);
  if (image.channels != 2 && image.channels != 4) return false;
  const float* alpha = image.Plane(image.channels - 1);
  return std::any_of(alpha, alpha + image.PlaneSize(), [](float a) { return a <= 0.5f; });
}

// Files in masks/, relative to the scene's folder.
class MaskFiles {
 public:
  explicit MaskFiles(const fs::path& scene_folder) {
    if (!IsFolder(scene_folder / kFolder)) return;
    for (const std::string& file : ListFiles(scene_folder / kFolder)) {
      all_.insert(kFolder + file);
      by_lower_case_.emplace(LowerCase(kFolder + file), kFolder + file);
    }
  }
  const std::set<std::string>& all() const { return all_; }
  // Returns the file of this name, or the only one that differs in case only; else empty.
  std::string Find(const std::string& name) const {
    if (all_.contains(name)) return name;
    const std::string key = LowerCase(name);
    return by_lower_case_.count(key) == 1 ? by_lower_case_.find(key)->second : "";
  }

 private:
  std::set<std::string> all_;
  std::multimap<std::string, std::string> by_lower_case_;
};

}  // namespace

std::vector<std::string> FindMasks(const fs::path& scene_folder,
                                   const std::vector<std::string>& photo_files,
                                   const std::vector<std::string>& other_photo_files,
                                   std::vector<std::string>* warnings) {
  const MaskFiles files(scene_folder);
  std::set<std::string> fitting;
  std::vector<std::string> masks;
  for (const std::string& photo : photo_files) {
    std::string& mask = masks.emplace_back();
    for (const std::string& name : MaskNames(photo)) {
      const std::string file = files.Find(name);
      if (file.empty()) continue;
      fitting.insert(file);
      if (mask.empty()) mask = file;
    }
    if (mask.empty() && HasTransparency(scene_folder / photo, photo)) mask = photo;
  }
  for (const std::string& photo : other_photo_files) {
    for (const std::string& name : MaskNames(photo)) fitting.insert(files.Find(name));
  }
  std::vector<std::string> unused;
  for (const std::string& file : files.all()) {
    if (!HasImageExtension(file)) {
      throw InvalidArgument("{} is no picture; masks are PNG files named like their photos", file);
    }
    if (!fitting.contains(file)) unused.push_back(file);
  }
  if (unused.empty()) return masks;
  if (unused.size() == files.all().size()) {
    throw InvalidArgument(
        "{} matches no photo; masks are named like their photos (a.png or a.jpg.png for "
        "a.jpg)",
        unused[0]);
  }
  if (warnings != nullptr) {
    warnings->push_back(fmt::format(
        "{} of {} masks match no photo and were left out: {}; masks are named like their photos "
        "(a.png or a.jpg.png for a.jpg)",
        unused.size(),
        files.all().size(),
        SummarizeNames(unused)));
  }
  return masks;
}

PictureNeed MaskNeed(const std::string& mask_file, int width, int height) {
  constexpr int64_t kBytesPerPixel = 28;  // four channels as stored and as floats, and two masks
  return {mask_file, width, height, kBytesPerPixel * width * height};
}

Image ReadMask(const fs::path& scene_folder,
               const std::string& mask_file,
               const std::string& photo_file,
               int width,
               int height) {
  const bool is_alpha = mask_file == photo_file;
  const std::string what =
      is_alpha ? "the alpha of " + photo_file : "the mask " + mask_file + " of " + photo_file;
  const PictureTurn turn(MaskNeed(mask_file, width, height));
  const Image image = DecodeImage(ReadFile(scene_folder / mask_file), mask_file, is_alpha);
  if (image.width != width || image.height != height) {
    throw InvalidArgument("{} is {}, the photo {}; save it at the photo's size",
                          what,
                          SizeText(image.width, image.height),
                          SizeText(width, height));
  }
  // Colour masks: mean of red, green and blue.
  const int first = is_alpha ? image.channels - 1 : 0;
  const int count = is_alpha ? 1 : image.channels;
  Image mask(width, height, 1);
  bool any = false;
  for (size_t i = 0; i < mask.data.size(); ++i) {
    float sum = 0.0f;
    for (int c = first; c < first + count; ++c) sum += image.Plane(c)[i];
    mask.data[i] = sum > 0.5f * static_cast<float>(count) ? 1.0f : 0.0f;
    any = any || mask.data[i] > 0.0f;
  }
  if (!any) {
    throw InvalidArgument(
        "{} masks out the whole photo: white is used, black is ignored; correct the mask or "
        "leave the photo out",
        what);
  }
  return mask;
}

void ClearMasked(const Image* mask, Image* image) {
  if (mask == nullptr) return;
  for (int c = 0; c < image->channels; ++c) {
    for (size_t i = 0; i < mask->data.size(); ++i) {
      if (mask->data[i] == 0.0f) image->Plane(c)[i] = 0.0f;
    }
  }
}

Image ResizeMask(const Image& mask, int width, int height) {
  Image resized = Resize(mask, width, height);
  for (float& value : resized.data) value = value >= kWhole ? 1.0f : 0.0f;
  return resized;
}

}  // namespace color3d
