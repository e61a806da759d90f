// Movies as people send them: MP4 with H.264, 4:2:0, colours tagged as BT.709. Pictures are coded
// as they come, so memory does not grow with the length (METHOD.md "Movies").
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "core/base/image.h"
#include "core/base/parallel.h"

namespace color3d {

struct Mp4Options {
  int width = 0;  // px, even, 16..8192
  int height = 0;
  double frames_per_second = 30.0;  // 1..120
  int threads = 1;                  // of the encoder
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

  // The next picture: sRGB in 0..1, 3 channels, of the size of the movie. Throws
  // Error{kResourceExhausted} when the disk is full.
  void Add(const Image& srgb, ThreadPool& pool);

  // Ends the movie; at least one picture must have been added. Throws as Add.
  void Finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace color3d
