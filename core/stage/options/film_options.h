// Options of the stage import_scene for films.
#pragma once

#include <optional>

namespace color3d {

inline constexpr int kMaxFilmFrames = 3000;

// Estimation of the frames' poses (film_import/film_poses.h).
enum class FilmPoses { kOff, kAuto };

struct FilmOptions {
  int stride = 1;  // every so many frames, 1..1000
  double begin_s = 0.0;
  std::optional<double> end_s;  // none: to the end
  // 1..120, of frames that come as pictures: 16 to 18 for silent film; none: 25. A video file has
  // times of its own.
  std::optional<double> frames_per_second;
  bool deflicker = false;  // exposure is made steady (film/steady_tones.h)
  FilmPoses poses = FilmPoses::kOff;
  void Validate() const;  // throws Error{kInvalidArgument}
  bool operator==(const FilmOptions&) const = default;
};

}  // namespace color3d
