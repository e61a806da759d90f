// What the ways to import films share: which frames are asked for, how they are kept and named, and
// how large their movie is. For this folder only.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/base/image.h"
#include "core/scene/scene.h"
#include "core/stage/film_import/import_film.h"

namespace color3d {

// What is taken for a camera that nobody knows.
Camera UnknownCamera(int width, int height);

// Frames that come as pictures below `folder`: their names, in the order of their numbers ...
std::vector<std::string> PicturesIn(const std::filesystem::path& folder);
// ... and when each is shown, s; frames that are missing by their numbers leave gaps, of which it
// warns (scene/frame_numbers.h).
std::vector<double> TimesOfPictures(const std::vector<std::string>& files,
                                    const FilmOptions& options,
                                    StageContext& context);

// Indices of the frames that are asked for, of a film whose frames are shown at `times`. Throws
// Error{kInvalidArgument} when there is none.
std::vector<int> RequestedFrames(const std::vector<double>& times, const FilmOptions& options);

// What a scene is that is not a film of one camera without poses.
enum class NoFilm { kPosedFilms, kCameraFilms, kCameraPictures, kTimedPictures, kPhotos };

// Warns of the options that were given and are of no use for it; nothing for none.
void WarnOfUnusedOptions(const FilmOptions& options, NoFilm scene, StageContext& context);

// Throws Error{kInvalidArgument}, with the stride and the length that would do, for more than
// kMaxFilmFrames. `seconds`: from the first to the last of them.
void CheckFrameCount(size_t frames, double seconds, const FilmOptions& options);

// Width and height of the movie of frames of that size: as they are, but even and no larger than
// movies may be.
std::pair<int, int> MovieSize(int width, int height);
// Throws Error{kInvalidArgument} that names `frames` where these are too small to be shown in the
// end.
void CheckMovieSize(const std::string& frames, int width, int height);

// Luminance (Lab L) as an 8-bit grey picture.
std::string EncodeGrayFrame(Image luminance);

// One warning that names a few of the frames; none without frames.
void WarnOfFrames(const std::vector<std::string>& names, const char* what, StageContext& context);
std::string NamesOfFrames(const std::vector<std::string>& names);
// The same of those of `film`'s views that `placed` has no view of.
void WarnOfFramesWithoutPlace(const Scene& film,
                              const std::vector<int>& views,
                              const Scene& placed,
                              StageContext& context);

}  // namespace color3d
