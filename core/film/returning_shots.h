// Shots of a film that show the place of a key frame again, behind a cut (METHOD.md "Film").
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/film/film_carry.h"

namespace color3d {

// The middle frames of shots of two frames or more that have none of `keys` (frames). Ascending.
std::vector<int> MiddlesWithoutKey(const std::vector<int>& shot, const std::vector<int>& keys);

// Looks for key frames in such shots. What features need of a key frame is made once for all shots.
class ReturningShots {
 public:
  // The references must outlive the object.
  ReturningShots(const FilmFrames& frames,
                 const std::vector<FilmKey>& keys,
                 const FilmCarryOptions& options,
                 ThreadPool& pool,
                 const CancellationToken& cancel);

  // A frame as a key frame of its shot, when it surely shows what one of the key frames shows, in
  // the colours of the one of which most is found again. Throws Error{kCancelled}.
  std::optional<FilmKey> KeyAt(int frame) const;

 private:
  const FilmFrames& frames_;
  const std::vector<FilmKey>& keys_;
  const FilmCarryOptions options_;
  ThreadPool& pool_;
  const CancellationToken& cancel_;
  std::vector<std::shared_ptr<const Image>> pictures_;  // of the key frames
  std::vector<std::optional<FoundAgain>> again_;        // of the key frames
};

}  // namespace color3d
