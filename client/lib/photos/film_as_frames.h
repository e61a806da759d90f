// Decodes a film's frames into a folder of pictures, for --benchmark.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/lib/photos/photo_folder.h"
#include "core/base/cancellation.h"

namespace color3d::client {

inline constexpr size_t kMostBenchmarkFrames = 3000;  // the limit of a job

struct FilmAsFrames {
  PhotoFolder folder;  // frames/f000000.png and so on; no film
  double frames_per_second = 0.0;
};

// Decodes the frames of `folder.film` before `end_s` (unset: all) into `scratch`, in colour, as the
// server would. Damaged frames are left out, with a note; so are irregular times. `on_frame`:
// frames done, of the total. Throws Error{kInvalidArgument} as FilmReader, for more than
// kMostBenchmarkFrames frames, for monochrome frames, and for fewer than three.
FilmAsFrames DecodeFilmFrames(const PhotoFolder& folder,
                              std::optional<double> end_s,
                              const std::filesystem::path& scratch,
                              const CancellationToken& cancel,
                              const std::function<void(int done, int total)>& on_frame);

}  // namespace color3d::client
