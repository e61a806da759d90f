// What several cameras filmed, on the clock that they share, and which frames of it are asked for.
// For this folder only.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/base/image.h"
#include "core/scene/formats/camera_films.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/film_import/import_film.h"

namespace color3d {

class FilmReader;

struct Footage {
  CameraFilm film;
  std::vector<std::string> pictures;  // where is_pictures: their files below it, in their order
  // Of all its frames, s since the first of all films; minus infinity of a frame that is shown at
  // nearly the time of the one before it, as in broken films.
  std::vector<double> times;
  std::vector<int> frames;  // that are asked for, in their order
};

// Empty when the scene has no films of several cameras (scene/formats/camera_films.h). Moments, a
// part and a stride of them, are asked for on the time that all cameras share; of frames where
// their clocks share no moments. Films without poses of which no transforms.json says when they
// began are put on one clock by their sound, where they have some in common. Warns of that, and of
// clocks that differ. Throws Error{kInvalidArgument}: what ReadCameraFilms refuses, a film without
// a frame that is asked for, more than kMaxFilmFrames in all.
std::vector<Footage> ReadFootage(const FilmOptions& options, StageContext& context);

// The frames of one camera, one after the other. Not thread-safe.
class FootageReader {
 public:
  // Throws Error{kInvalidArgument} for a film that cannot be read. `footage` must outlive this.
  FootageReader(const Footage& footage, const StageContext& context);
  ~FootageReader();
  bool interlaced() const;
  // What a user should know of how a video is read (FilmFacts::notes).
  std::vector<std::string> notes() const;
  // Below the camera's folder: f000012.png, or as the picture is called.
  std::string NameOf(int frame) const;
  // sRGB or grey, as people see it. Throws Error{kDataLoss} for a damaged frame of a video.
  Image Read(int frame);

 private:
  const Footage& footage_;
  std::filesystem::path file_;
  std::unique_ptr<FilmReader> video_;  // none: pictures
};

}  // namespace color3d
