// Films that somebody brought to the studio: what the page shows of them before the service has
// them, and their frames as pictures. A film is a video file, or numbered pictures. Thread-safe;
// frames of one film are decoded one after the other.
#pragma once

#include <filesystem>
#include <list>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/lib/out_folder.h"
#include "client/lib/photos/photo_folder.h"
#include "core/base/cancellation.h"
#include "core/base/files.h"
#include "core/base/image.h"
#include "core/base/mutex.h"

namespace color3d::client {

class FilmFrames {
 public:
  // `cancel` ends reading and must outlive this object.
  explicit FilmFrames(const CancellationToken& cancel) : cancel_(cancel) {}

  // frames, seconds, frames_per_second, width, height, codec ("" for pictures), has_sound, in_color
  // (null if unsure), is_video and notes. A video file is read once for the times of its frames.
  // Throws Error{kInvalidArgument} with the file's name if it cannot be decoded.
  nlohmann::ordered_json Describe(const PhotoFolder& folder);

  // A frame by the name of its view ("f000012", or the name of its picture), as JPEG with its
  // longer side at most `max_side_px` (0: its own size). `gray`: its luminance. Throws
  // Error{kNotFound} for a name without a frame, kDataLoss if it is damaged.
  std::string Jpeg(const PhotoFolder& folder, const std::string& view, int max_side_px, bool gray);
  // The same of any film file, by the number of the frame.
  std::string JpegOfFile(const std::filesystem::path& film, int frame, int max_side_px, bool gray);

  // The frame as a file, for calls that take photos; a PNG that is kept for a while, or the
  // picture.
  LocalFile File(const PhotoFolder& folder, const std::string& view);

 private:
  struct OpenFilm;
  std::shared_ptr<OpenFilm> Open(const std::filesystem::path& film);
  Image Read(const std::filesystem::path& film, int frame);

  const CancellationToken& cancel_;
  const ScratchFolder scratch_;
  Mutex mutex_;
  std::list<std::shared_ptr<OpenFilm>> open_ COLOR3D_GUARDED_BY(mutex_);  // the last used first
  std::list<std::filesystem::path> files_ COLOR3D_GUARDED_BY(mutex_);     // likewise
};

}  // namespace color3d::client
