// Kinds of a scene's files, by their names.
#pragma once

#include <algorithm>
#include <cctype>
#include <iterator>
#include <string>
#include <string_view>

#include "core/base/text/lower_case.h"

namespace color3d {

// True for supported splats: .ply .sog .spz, any case.
inline bool HasSplatExtension(std::string_view path) {
  if (path.size() < 4) return false;
  const std::string ending = LowerCase(path.substr(path.size() - 4));
  return ending == ".ply" || ending == ".sog" || ending == ".spz";
}

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

// True for extensions of supported films, any case.
inline bool HasFilmExtension(std::string_view path) {
  const std::string ending = LowerCase(path.substr(std::min(path.size(), path.find_last_of('.'))));
  return std::ranges::find(kFilmEndings, ending) != std::end(kFilmEndings);
}

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
