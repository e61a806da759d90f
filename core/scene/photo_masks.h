// Masks of photos: the pixels that are used. Read from masks/ of the scene's folder and from the
// alpha of PNG photos. Pure functions of the file system, thread-safe.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/image.h"
#include "core/image/decode_budget.h"

namespace color3d {

// Returns the mask of each photo: a path relative to the scene's folder, the photo itself if its
// alpha is the mask, or empty if there is none. The mask of images/a/b.jpg is masks/a/b.jpg.png (as
// in COLMAP) or masks/a/b.png, and has priority over alpha. Opaque photos have no alpha mask. Case
// is ignored if only one mask fits. `photo_files`: relative to the scene's folder. `warnings` (may
// be null) receives the masks that belong to neither `photo_files` nor `other_photo_files`; they
// are left out. Throws Error{kInvalidArgument} that names a file in masks/ that is no picture, or
// if no mask belongs to any photo.
std::vector<std::string> FindMasks(const std::filesystem::path& scene_folder,
                                   const std::vector<std::string>& photo_files,
                                   const std::vector<std::string>& other_photo_files,
                                   std::vector<std::string>* warnings = nullptr);

// Returns 1 channel: 1 where the mask is brighter than half (or more opaque), else 0. Throws
// Error{kInvalidArgument} that names the file if it cannot be read, differs from width x height px
// (the size of the photo after EXIF orientation), or masks out everything.
Image ReadMask(const std::filesystem::path& scene_folder,
               const std::string& mask_file,
               const std::string& photo_file,
               int width,
               int height);

// Memory that ReadMask and the use of the mask at full size need for a file of this size.
PictureNeed MaskNeed(const std::string& mask_file, int width, int height);

// Sets all channels of `image` to 0 where the mask is 0. `mask`: the size of `image`; null: nothing
// is masked out.
void ClearMasked(const Image* mask, Image* image);

// Returns the mask at another size: 1 where all pixels covered are 1.
Image ResizeMask(const Image& mask, int width, int height);

}  // namespace color3d
