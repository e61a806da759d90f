// Writes MP4 movies: H.264, 4:2:0, tagged as BT.709, with the sound of the source film. Pictures
// are encoded as they are added, so memory does not grow with the length (EXPORT.md "Movies").
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/parallel.h"

namespace color3d {

// The sound of a film between two times of its file: FilmReader::times plus FilmFacts::first_s.
struct SoundPart {
  std::filesystem::path film;
  double begin_s = 0.0;  // at the movie's first picture
  double end_s = 0.0;
  bool operator==(const SoundPart&) const = default;
};

// Limits of a movie's width and height.
inline constexpr int kMinMovieSidePx = 16, kMaxMovieSidePx = 8192;

struct Mp4Options {
  int width = 0;  // px, even, kMinMovieSidePx..kMaxMovieSidePx
  int height = 0;
  double frames_per_second = 30.0;  // 1..120
  // 1..65535: pictures have their own times (AddAt), rounded to this number of ticks a second
  // (ticks.h). 0: constant frame rate.
  int ticks_per_second = 0;
  std::optional<SoundPart> sound;
  const CancellationToken* cancel = nullptr;  // cancels reading the sound; must outlive the writer
  bool operator==(const Mp4Options&) const = default;
};

// Equal pictures give equal bytes. Not thread-safe.
class Mp4Writer {
 public:
  // The movie appears at `path` when Finish returns; without Finish no file is left. Throws
  // Error{kInvalidArgument} for unsupported sizes, Error{kFailedPrecondition} if FFmpeg's libraries
  // have no suitable encoder or the file cannot be written.
  Mp4Writer(std::filesystem::path path, const Mp4Options& options);
  ~Mp4Writer();
  Mp4Writer(const Mp4Writer&) = delete;
  Mp4Writer& operator=(const Mp4Writer&) = delete;

  // FFmpeg's name of the encoder; "libx264" if available.
  const std::string& encoder() const;

  // A note for the user if the requested sound is missing from the movie; empty if nothing is
  // missing.
  const std::string& sound_warning() const;

  // Adds the next picture: sRGB in 0..1, 3 channels, of the movie's size. Throws
  // Error{kResourceExhausted} if the disk is full, Error{kCancelled}.
  void Add(const Image& srgb, ThreadPool& pool);
  // The same for pictures with times, in seconds from the first one, ascending by at least one
  // tick; the last picture is shown for `seconds` > 0. Throws Error{kInvalidArgument} for other
  // times.
  void AddAt(double time_s, double seconds, const Image& srgb, ThreadPool& pool);

  // Completes the movie; requires at least one picture. Throws as Add.
  void Finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace color3d
