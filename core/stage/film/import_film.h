// A film as a scene: its frames are the views, all of one camera that is not known, unless its
// poses are asked for and found. For the import stage only.
#pragma once

#include <optional>
#include <string>

#include "core/scene/import.h"
#include "core/stage/stage.h"

namespace color3d {

inline constexpr int kMaxFilmFrames = 3000;

// Whether the frames' poses are looked for (film_poses.h).
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

// The film that the scene consists of: a video file, or "frames/" for pictures in that folder.
// Empty where it is none.
std::string FindFilm(const std::filesystem::path& scene_folder);

// Leaves kScene, kImportFacts and, of a video file or where exposure is made steady, the frames in
// grey as kGivenViews; with poses kMovingRegions and kSfmLog, too. Of `import`, every eighth frame
// held out and, for poses, what is said of structure-from-motion count. Frames that cannot be
// decoded are left out; those, and blank and torn ones, are named in a warning. Throws
// Error{kInvalidArgument}: no film that can be read, nothing between the times that are asked for,
// one frame, more than kMaxFilmFrames (with the stride and the length that would do), frames that
// are too small for a movie, of different sizes or of names that differ in their endings only, a
// rate for a video file, a camera to hold out.
void ImportFilm(const std::string& film,
                const FilmOptions& options,
                const ImportOptions& import,
                StageContext& context);

}  // namespace color3d
