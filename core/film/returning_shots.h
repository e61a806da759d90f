// Shots of a film that show the place of a key frame again, behind a cut (METHOD.md "Film").
#pragma once

#include <optional>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/film/film_carry.h"

namespace color3d {

// The middle frames of shots of two frames or more that have none of `keys` (frames). Ascending.
std::vector<int> MiddlesWithoutKey(const std::vector<int>& shot, const std::vector<int>& keys);

// A frame of such a shot as a key frame, when it surely shows what one of `keys` shows, in the
// colours of the one of which most is found again. Throws Error{kCancelled}.
std::optional<FilmKey> KeyOfReturningShot(const FilmFrames& frames,
                                          int frame,
                                          const std::vector<FilmKey>& keys,
                                          const FilmCarryOptions& options,
                                          ThreadPool& pool,
                                          const CancellationToken& cancel);

}  // namespace color3d
