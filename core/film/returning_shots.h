// Finds shots of a film that show the place of a key frame again after a cut (FILM.md "Film").
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/film/film_carry.h"

namespace color3d {

// Middle frames of the shots with two frames or more that contain none of the frames `keys`,
// ascending.
std::vector<int> UnkeyedShotMiddles(const std::vector<int>& shot, const std::vector<int>& keys);

// Looks for key frames in such shots. Features of a key frame are computed once for all shots.
class ReturningShots {
 public:
  // The references must outlive the object.
  ReturningShots(const FilmFrames& frames,
                 const std::vector<FilmKey>& keys,
                 const FilmCarryOptions& options,
                 ThreadPool& pool,
                 const CancellationToken& cancel);

  // Returns the frame as a key frame of its shot, in the colours of the key frame of which it shows
  // most; nothing when it shows too little of all. Throws Error{kCancelled}.
  std::optional<FilmKey> KeyAt(int frame) const;

 private:
  const FilmFrames& frames_;
  const std::vector<FilmKey>& keys_;
  const FilmCarryOptions options_;
  ThreadPool& pool_;
  const CancellationToken& cancel_;
  std::vector<std::shared_ptr<const Image>> pictures_;      // of the key frames
  std::vector<std::optional<ReappearingRegions>> regions_;  // of the key frames
};

}  // namespace color3d
