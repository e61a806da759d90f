// Options of the stage render.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace color3d {

inline constexpr int kMaxMovieFrames = 18'000;   // ten minutes at 30 frames a second
inline constexpr int kMaxMoviePictures = 1'000;  // of them, where each is kept as a picture
inline constexpr int kDefaultMovieFrames = 240;

struct RenderOptions {
  // Pictures of views; or a movie: on the turn around the key view, through the photos' cameras in
  // the order of their names (of a scene that moves: frame by frame with the key view's camera), by
  // the cameras of a file, or where the key view's camera stood.
  enum class Path { kViews, kOrbit, kPhotos, kCameras, kStill };
  // By name. For kViews; empty: held-out views, or evenly spread ones. For kPhotos, in this order;
  // empty: all.
  std::vector<std::string> views;
  int max_views = 12;     // 1..1000, for the empty list
  int max_side_px = 500;  // 64..4096
  Path path = Path::kViews;
  // The rest is of movies, but for `pictures`. 1..kMaxMovieFrames; nothing: kDefaultMovieFrames, of
  // a file of cameras one for each, of a scene that moves with kPhotos and kStill one for each
  // moment.
  std::optional<int> frames;
  double frames_per_second = 30.0;  // 1..120
  bool video = true;                // kMovie is made
  // kFrames are kept, at most kMaxMoviePictures; with kViews, of a film and of what cameras filmed,
  // kFilmFrames.
  bool pictures = false;
  bool bounce = false;  // there and back again
  // Of a scene that moves: it stands still at this time, seconds; nothing: time runs.
  std::optional<double> time_s;
  std::filesystem::path cameras;  // for kCameras: scene/formats/camera_file.h
  void Validate() const;
  bool operator==(const RenderOptions&) const = default;
};

}  // namespace color3d
