// Movies as people send them: MP4 with H.264, 4:2:0, colours tagged as BT.709, and the sound of the
// film that they come from. Pictures are coded as they come, so memory does not grow with the
// length (EXPORT.md "Movies").
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/parallel.h"

namespace color3d {

// What a film's file sounds like from one time of its own to another: FilmFacts::first_s more than
// FilmReader::times.
struct SoundPart {
  std::filesystem::path film;
  double begin_s = 0.0;  // with the movie's first picture
  double end_s = 0.0;
  bool operator==(const SoundPart&) const = default;
};

// Of a movie's sides.
inline constexpr int kMinMovieSidePx = 16, kMaxMovieSidePx = 8192;

struct Mp4Options {
  int width = 0;  // px, even, kMinMovieSidePx..kMaxMovieSidePx
  int height = 0;
  double frames_per_second = 30.0;  // 1..120
  // 1..65535: pictures have times of their own (AddAt), which are rounded to so many ticks a second
  // (ticks.h); 0: they follow each other evenly.
  int ticks_per_second = 0;
  int threads = 1;  // of the encoder
  std::optional<SoundPart> sound;
  const CancellationToken* cancel = nullptr;  // of reading the sound; outlives the writer
  bool operator==(const Mp4Options&) const = default;
};

// Not thread-safe.
class Mp4Writer {
 public:
  // The movie is at `path` when Finish returns, and without it nothing is. Throws
  // Error{kInvalidArgument} for sizes that no movie has, Error{kFailedPrecondition} when FFmpeg's
  // libraries have no encoder that would do or the file cannot be written.
  Mp4Writer(std::filesystem::path path, const Mp4Options& options);
  ~Mp4Writer();
  Mp4Writer(const Mp4Writer&) = delete;
  Mp4Writer& operator=(const Mp4Writer&) = delete;

  // Of FFmpeg's; "libx264" where there is that.
  const std::string& encoder() const;

  // What became of the sound that was asked for: a line for people where it is not in the movie;
  // empty: nothing is missing.
  const std::string& sound_warning() const;

  // The next picture: sRGB in 0..1, 3 channels, of the size of the movie. Throws
  // Error{kResourceExhausted} when the disk is full, Error{kCancelled}.
  void Add(const Image& srgb, ThreadPool& pool);
  // The same for pictures with times, s from the first one's, which must ascend by a tick at least;
  // shown for `seconds` > 0 if it is the last. Throws Error{kInvalidArgument} for other times.
  void AddAt(double time_s, double seconds, const Image& srgb, ThreadPool& pool);

  // Ends the movie; at least one picture must have been added. Throws as Add.
  void Finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace color3d
