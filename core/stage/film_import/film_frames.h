// Parts that the imports of films share: requested frames, their pictures and names, and the size
// of the movie. For this folder only.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/base/image.h"
#include "core/scene/scene.h"
#include "core/stage/film_import/import_film.h"

namespace color3d {

// Names of the pictures below `folder`, in the order of their numbers.
std::vector<std::string> PicturesIn(const std::filesystem::path& folder);
// Times of these pictures, seconds. Missing numbers leave gaps and cause a warning
// (scene/frame_numbers.h).
std::vector<double> TimesOfPictures(const std::vector<std::string>& files,
                                    const FilmOptions& options,
                                    StageContext& context);

// Indices of the frames in the requested part of a film with a stride. `times`: of all its frames,
// seconds. Throws Error{kInvalidArgument} if there is none.
std::vector<int> RequestedFrames(const std::vector<double>& times, const FilmOptions& options);

// Captures other than a film of one camera without poses.
enum class ImportedAs { kPosedFilms, kCameraFilms, kCameraPictures, kTimedPictures, kPhotos };

// Warns of options that differ from their default and have no effect on such a capture.
void WarnOfUnusedOptions(const FilmOptions& options, ImportedAs scene, StageContext& context);

// Throws Error{kInvalidArgument}, with a stride and a length that fit, for more than
// kMaxFilmFrames. `seconds`: from the first to the last frame.
void CheckFrameCount(size_t frames, double seconds, const FilmOptions& options);

// Width and height of a movie of frames of this size: even, and within the limits of movies.
std::pair<int, int> MovieSize(int width, int height);
// Throws Error{kInvalidArgument} if the frames are too small for a movie. `frames`: for the
// message.
void CheckMovieSize(const std::string& frames, int width, int height);

// Encodes luminance (Lab L) as an 8-bit grey PNG.
std::string EncodeGrayFrame(Image luminance);

// Warns with the number and some names of the frames, unless there are none.
void WarnOfFrames(const std::vector<std::string>& names, const char* what, StageContext& context);
// The first of the names, and the number of the others.
std::string NamesOfFrames(const std::vector<std::string>& names);
// WarnOfFrames for those of `views` that `placed` does not have.
void WarnOfUnplacedFrames(const Scene& film,
                          const std::vector<int>& views,
                          const Scene& placed,
                          StageContext& context);

}  // namespace color3d
