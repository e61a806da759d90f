// The studio's calls for sharing (client/studio/README.md).
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "client/lib/photos/photo_folder.h"
#include "client/studio/fetched_files.h"
#include "client/studio/film/film_frames.h"
#include "client/studio/share/share_calls.h"
#include "client/studio/studio_routes.h"

namespace color3d::client {

struct ShareParts {
  std::filesystem::path folder;  // keeps the credit that the user typed
  std::function<PhotoFolder(const std::string& set)> photos_of;
  FetchedFiles* fetched = nullptr;
  FilmFrames* frames = nullptr;
  const CancellationToken* cancel = nullptr;
};

// Requires: what `parts` and `calls` refer to outlives the server of the routes.
void AddShareRoutes(const StudioRoutes& routes, const ShareParts& parts, const ShareCalls& calls);

}  // namespace color3d::client
