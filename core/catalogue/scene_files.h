// Kinds of a scene's files, by their names.
#pragma once

#include <algorithm>
#include <cctype>
#include <iterator>
#include <string>
#include <string_view>

#include "core/base/text/lower_case.h"

namespace color3d {

inline constexpr std::string_view kFilmEndings[] = {".mp4",
                                                    ".m4v",
                                                    ".mov",
                                                    ".3gp",
                                                    ".mkv",
                                                    ".webm",
                                                    ".avi",
                                                    ".dv",
                                                    ".mpg",
                                                    ".mpeg",
                                                    ".vob",
                                                    ".ts",
                                                    ".mts",
                                                    ".m2ts",
                                                    ".mxf",
                                                    ".flv",
                                                    ".ogv",
                                                    ".wmv"};

inline constexpr std::string_view kSplatEndings[] = {".ply", ".sog", ".spz"};

// True if the extension is one of `endings`, any case.
template <size_t kCount>
bool HasExtension(std::string_view path, const std::string_view (&endings)[kCount]) {
  const std::string own = LowerCase(path.substr(std::min(path.size(), path.find_last_of('.'))));
  return std::ranges::find(endings, own) != std::end(endings);
}
inline bool HasFilmExtension(std::string_view path) { return HasExtension(path, kFilmEndings); }
inline bool HasSplatExtension(std::string_view path) { return HasExtension(path, kSplatEndings); }

// Colour pictures from the user for training the colorizer: no photos of the scene.
inline bool IsAugmentFile(std::string_view path) { return path.starts_with("augment/"); }

// Masks of photos: the pixels that are used.
inline bool IsMaskFile(std::string_view path) { return path.starts_with("masks/"); }

// Folder of the frames of a film as pictures, in the order of their names.
inline constexpr std::string_view kFramesFolder = "frames/";
inline bool IsFrameFile(std::string_view path) { return path.starts_with(kFramesFolder); }

// In the scene's folder: capture times of the photos of a COLMAP model.
inline constexpr std::string_view kTimesFile = "times.txt";

}  // namespace color3d
