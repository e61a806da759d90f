// The part of the studio's calls that is about dropped photos and films: what was found, pictures,
// previews and runs (client/studio/README.md).
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "client/studio/film/film_frames.h"
#include "client/studio/photo_sets.h"
#include "client/studio/studio_calls.h"
#include "client/studio/studio_routes.h"
#include "core/base/cancellation.h"

namespace color3d::client {

// What the calls work with; all must outlive the routes.
struct SetRouteParts {
  PhotoSets& sets;
  const StudioCalls& calls;
  FilmFrames& films;
  const CancellationToken& cancel;
  int64_t max_file_bytes;  // of a dropped file
  // Files of a set.
  std::function<PhotoFolder(const std::string& set)> folder_of;
  // "scenes/..." of a set, uploaded if it is not there yet.
  std::function<std::string(const std::string& set)> scene_of;
};

void AddSetRoutes(const SetRouteParts& parts, const StudioRoutes& routes);

}  // namespace color3d::client
