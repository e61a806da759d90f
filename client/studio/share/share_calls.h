// What a coloured scene is shared as: movies, files of other formats, photos in colour. Asks the
// service; thread-safe.
#pragma once

#include <optional>
#include <string>

#include "client/lib/photos/photo_folder.h"
#include "client/studio/shared_connection.h"
#include "color3d/v1/job.pb.h"

namespace color3d::client {

struct MovieWish {
  std::string path;  // "orbit", "photos" or, for scenes that move, "still"
  std::optional<double> seconds;
  std::optional<int> max_side_px;
  bool bounce = false;  // back along the path at its end
};

class ShareCalls {
 public:
  // `connection` must outlive the calls.
  explicit ShareCalls(SharedConnection& connection) : connection_(connection) {}

  // Submits a movie of the scene that the job `run` coloured. Throws Error{kInvalidArgument} for
  // other paths and for lengths beyond 1 to 120 s.
  v1::Job MakeMovie(const std::string& run, const MovieWish& wish) const;
  // Submits its export in one format, e.g. "spz".
  v1::Job MakeFile(const std::string& run, const std::string& format) const;
  // The photo as PNG in the colours that the scene has learned, its longer side at most
  // `max_side_px` (0: its own size).
  std::string ColoredPhoto(const std::string& run, const LocalFile& photo, int max_side_px) const;

 private:
  SharedConnection& connection_;
};

}  // namespace color3d::client
