// The sound of a part of a film for MP4 (FILM.md "Film"): packets are copied if MP4 supports the
// codec, else re-encoded as AAC. For this folder only.
#pragma once

#include <memory>
#include <string>

#include "core/base/cancellation.h"
#include "core/video/libav.h"
#include "core/video/mp4_writer.h"

namespace color3d {

// Reads the audio stream that players choose. Not thread-safe.
class FilmSound {
 public:
  // Does not throw for a file without sound or with unreadable sound. `cancel` may be null and must
  // outlive this object; throws Error{kCancelled}.
  FilmSound(const SoundPart& part, const CancellationToken* cancel);
  ~FilmSound();

  // Null if there is no sound.
  const AVCodecParameters* parameters() const;
  AVRational time_base() const;  // time base of Next
  // Why there is no sound or how it was changed; empty if it is complete or the film has none.
  const std::string& warning() const;

  // Returns the next packet. Its time counts from the start of the part and may be up to two
  // packets earlier, as decoder preroll. Returns false after the last one. Throws
  // Error{kCancelled}.
  bool Next(AVPacket* packet);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace color3d
