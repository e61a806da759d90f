// Films of several cameras on a common clock, and their requested frames. For this folder only.
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
  std::vector<std::string>
      pictures;  // if is_pictures: their names in order, relative to the folder
  // Times of all frames, seconds since the first frame of all films. Minus infinity for a frame at
  // nearly the time of the one before it, as in damaged films.
  std::vector<double> times;
  std::vector<int> frames;  // requested ones, in order
};

// Reads the films of several cameras (scene/formats/camera_films.h); returns none for other scenes.
// A requested part and stride refer to the times of all cameras, or to the frames of each camera if
// their clocks share no times. Films without poses are aligned by their sound, unless
// transforms.json gives time offsets or they have no sound in common. Warns of such alignment and
// of clocks that differ. Throws Error{kInvalidArgument}: errors of ReadCameraFilms, a film without
// requested frames, more than kMaxFilmFrames in all.
std::vector<Footage> ReadFootage(const FilmOptions& options, StageContext& context);

// Reads the frames of one camera. Not thread-safe.
class FootageReader {
 public:
  // Throws Error{kInvalidArgument} for a film that cannot be read. `footage` must outlive this.
  FootageReader(const Footage& footage, const StageContext& context);
  ~FootageReader();
  bool interlaced() const;
  // Notes for the user on how a video is read (FilmFacts::notes).
  std::vector<std::string> notes() const;
  // Name of a frame within its camera: "f000012.png", or the name of the picture.
  std::string NameOf(int frame) const;
  // sRGB or grey, in display orientation. Throws Error{kDataLoss} for a damaged frame of a video.
  Image Read(int frame);

 private:
  const Footage& footage_;
  std::filesystem::path file_;
  std::unique_ptr<FilmReader> video_;  // null for pictures
};

}  // namespace color3d
