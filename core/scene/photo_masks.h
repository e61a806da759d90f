// Masks of photos: which pixels count. Files in masks/ of the scene's folder, and the alpha of PNG
// photos. Pure functions of the file system, thread-safe.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/image.h"
#include "core/image/decode_budget.h"

namespace color3d {

// The mask of each photo: a path relative to the scene's folder, which is the photo's own where its
// alpha is the mask, or empty where there is none. images/a/b.jpg has the mask masks/a/b.jpg.png
// (as COLMAP has it) or masks/a/b.png, which wins over its alpha; an opaque photo has none. The
// case of letters does not matter where one mask fits. `photo_files`: relative to the scene's
// folder. `warnings` (may be null) receives which masks are of none of `photo_files` and
// `other_photo_files`: they are left out. Throws Error{kInvalidArgument} that names a file in
// masks/ that is no picture, and where no mask is of any photo.
std::vector<std::string> FindMasks(const std::filesystem::path& scene_folder,
                                   const std::vector<std::string>& photo_files,
                                   const std::vector<std::string>& other_photo_files,
                                   std::vector<std::string>* warnings = nullptr);

// 1 channel: 1 where the photo counts (the mask is brighter than half, or more opaque), else 0.
// Throws Error{kInvalidArgument} that names the file when it cannot be read, or is not width x
// height px, the photo's size after EXIF orientation (with both sizes), or leaves nothing.
Image ReadMask(const std::filesystem::path& scene_folder,
               const std::string& mask_file,
               const std::string& photo_file,
               int width,
               int height);

// What ReadMask takes of a file of this size, and what is done with its mask at full size.
PictureNeed MaskNeed(const std::string& mask_file, int width, int height);

// Sets all channels of `image` to 0 where the mask (of its size; null: everything counts) is 0.
void ClearMasked(const Image* mask, Image* image);

// A mask at another size: 1 where all that a pixel covers counts.
Image ResizeMask(const Image& mask, int width, int height);

}  // namespace color3d
