// The sound of a part of a film as MP4 takes it (FILM.md "Film"): packets as they are where the
// codec is one that MP4 holds, else coded again as AAC. For this folder only.
#pragma once

#include <memory>
#include <string>

#include "core/base/cancellation.h"
#include "core/video/libav.h"
#include "core/video/mp4_writer.h"

namespace color3d {

// Of the stream of sound that players play. Not thread-safe.
class FilmSound {
 public:
  // Throws nothing for a file without sound or with one that cannot be had. `cancel` may be null
  // and outlives this object; throws Error{kCancelled}.
  FilmSound(const SoundPart& part, const CancellationToken* cancel);
  ~FilmSound();

  // None: there is no sound.
  const AVCodecParameters* parameters() const;
  AVRational time_base() const;  // of Next
  // Why there is none, or what was done to it; empty: it is whole, or there never was any.
  const std::string& warning() const;

  // The next packet; its time counts from the part's beginning and may lie up to two packets before
  // it, for the decoder to begin with. False behind the last one. Throws Error{kCancelled}.
  bool Next(AVPacket* packet);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace color3d
