#include "client/lib/photos/mask_files.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <map>

#include "client/lib/photos/skipped_files.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/base/text/lower_case.h"
#include "core/image/probe/orientation.h"
#include "core/image/probe/probe.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

// Possible names of the mask of a photo, relative to the folder of masks.
std::vector<std::string> MaskNames(std::string photo) {
  if (photo.starts_with("images/")) photo.erase(0, 7);
  return {photo + ".png", fs::path(photo).replace_extension(".png").generic_string()};
}

std::string Size(int width, int height) { return fmt::format("{} x {} px", width, height); }

void RequireSizeOf(const fs::path& mask, const fs::path& photo) {
  const ImageInfo of_mask = ProbeImage(ReadFile(mask), mask.string());
  if (of_mask.format != ImageFormat::kPng) {
    throw InvalidArgument("the mask {} is not a PNG; save it as one", mask.string());
  }
  const std::string bytes = ReadFile(photo);
  const PictureSize size = OrientedSize(ProbeImage(bytes, photo.string()), ReadOrientation(bytes));
  if (of_mask.width == size.width && of_mask.height == size.height) return;
  throw InvalidArgument("the mask {} is {}, its photo {}; save it at the photo's size",
                        mask.string(),
                        Size(of_mask.width, of_mask.height),
                        Size(size.width, size.height));
}

}  // namespace

void AddMasks(const fs::path& masks, PhotoFolder* folder) {
  if (!IsFolder(masks)) {
    throw InvalidArgument("--masks {}: there is no such folder", masks.string());
  }
  std::map<std::string, const LocalFile*> photo_of;
  std::multimap<std::string, const LocalFile*> photo_of_lower_case;
  for (const LocalFile& photo : folder->photos) {
    for (const std::string& name : MaskNames(photo.path)) {
      photo_of.emplace(name, &photo);
      photo_of_lower_case.emplace(LowerCase(name), &photo);
    }
  }
  std::map<const LocalFile*, std::string> mask_of;
  std::vector<std::string> unused;
  for (const std::string& file : ListFiles(masks)) {
    if (IsSystemPath(file)) continue;
    const auto exact = photo_of.find(file);
    const LocalFile* photo = exact != photo_of.end() ? exact->second : nullptr;
    if (photo == nullptr && photo_of_lower_case.count(LowerCase(file)) == 1) {
      photo = photo_of_lower_case.find(LowerCase(file))->second;
    }
    if (photo == nullptr) {
      unused.push_back((masks / file).string());
      continue;
    }
    const auto [other, is_first] = mask_of.emplace(photo, file);
    if (!is_first) {
      throw InvalidArgument(
          "--masks: {} has two masks, {} and {}", photo->path, other->second, file);
    }
    RequireSizeOf(masks / file, photo->file);
    folder->mask_files.push_back({"masks/" + file, masks / file});
  }
  if (folder->mask_files.empty() && !unused.empty()) {
    throw InvalidArgument(
        "--masks: {} matches no photo; masks are PNG files named like their photos "
        "(a.png or a.jpg.png for a.jpg)",
        unused[0]);
  }
  if (folder->mask_files.empty()) {
    throw InvalidArgument("--masks {}: there is no mask in it", masks.string());
  }
  folder->notes.push_back(
      fmt::format("{} of {} photos have masks", mask_of.size(), folder->photos.size()));
  if (!unused.empty()) {
    folder->notes.push_back(
        fmt::format("{} of {} masks match no photo and were left out (e.g. {}); masks are named "
                    "like their photos (a.png or a.jpg.png for a.jpg)",
                    unused.size(),
                    unused.size() + mask_of.size(),
                    unused[0]));
  }
  constexpr size_t kMaxFiles = 10'000;
  if (folder->AllFiles().size() > kMaxFiles) {
    throw InvalidArgument("photos and masks are {} files; at most {} make up a scene",
                          folder->AllFiles().size(),
                          kMaxFiles);
  }
}

}  // namespace color3d::client
