// Options of the stage render.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace color3d {

inline constexpr int kMaxMovieFrames = 18'000;   // ten minutes at 30 frames per second
inline constexpr int kMaxMoviePictures = 1'000;  // frames that can be kept as pictures
inline constexpr int kDefaultMovieFrames = 240;

struct RenderOptions {
  // Pictures of views, or a movie: around the key view, through the cameras of the photos in the
  // order of their names (for dynamic scenes, frame by frame with the camera of the key view), by
  // the cameras of a file, or with the camera of the key view standing still.
  enum class Path { kViews, kOrbit, kPhotos, kCameras, kStill };
  // Names. For kViews; empty: the held-out views, else evenly spread ones. For kPhotos, in this
  // order; empty: all.
  std::vector<std::string> views;
  int max_views = 12;     // 1..1000, if `views` is empty
  int max_side_px = 500;  // 64..4096
  Path path = Path::kViews;
  // Movies only: number of frames, 1..kMaxMovieFrames. Default: kDefaultMovieFrames; one for each
  // camera of a file; for dynamic scenes with kPhotos and kStill one for each time.
  std::optional<int> frames;
  double frames_per_second = 30.0;  // 1..120
  bool video = true;                // writes kMovie
  // Writes kFrames, at most kMaxMoviePictures; with kViews, for films and dynamic scenes,
  // kFilmFrames.
  bool pictures = false;
  bool bounce = false;  // goes back along the path at its end
  // Dynamic scenes: the time that is shown throughout, seconds. Default: time passes.
  std::optional<double> time_s;
  std::filesystem::path cameras;  // for kCameras: scene/formats/camera_file.h
  void Validate() const;
  bool operator==(const RenderOptions&) const = default;
};

}  // namespace color3d
