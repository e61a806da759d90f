// A film's frames as pictures in a folder: what --benchmark takes.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/lib/photos/photo_folder.h"
#include "core/base/cancellation.h"

namespace color3d::client {

inline constexpr size_t kMostBenchmarkFrames = 3000;  // as many as a job takes

struct FilmAsFrames {
  PhotoFolder folder;  // frames/f000000.png and so on; no film
  double frames_per_second = 0.0;
};

// Decodes the frames of `folder.film` that are shown before `end_s` (none: all) into `scratch`, in
// colour, as the server would. Frames that are damaged are left out, with a note; so are uneven
// times. `on_frame`: frames done, of so many. Throws Error{kInvalidArgument}: what FilmReader
// throws; more frames than kMostBenchmarkFrames; monochrome frames; fewer than three.
FilmAsFrames TakeFramesOfFilm(const PhotoFolder& folder,
                              std::optional<double> end_s,
                              const std::filesystem::path& scratch,
                              const CancellationToken& cancel,
                              const std::function<void(int done, int total)>& on_frame);

}  // namespace color3d::client
