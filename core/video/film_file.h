// A film's file, opened the one way that films are opened: as one file of a container that we
// support. Whatever other file, address or device it names stays closed. For this folder only.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/video/libav.h"

namespace color3d {

// `why` it is no film: throws Error{kInvalidArgument} that names the file.
[[noreturn]] void RefuseFilm(const std::filesystem::path& file, const std::string& why);

// Of a film's frames; larger ones are never decoded.
inline constexpr int kMaxFilmSidePx = 8192;
inline constexpr int64_t kMaxFilmPixels = int64_t{kMaxFilmSidePx} * kMaxFilmSidePx;

// Not thread-safe.
class FilmFile {
 public:
  // Opens the file and finds its streams. FFmpeg's libraries get its bytes from us and can open
  // nothing else. `cancel` may be null; it outlives this object, and ends what the libraries do.
  // Throws Error{kNotFound} when there is no such regular file; Error{kInvalidArgument} that names
  // the file and says what it is when it is no container of films, or when its frames are larger
  // than kMaxFilmSidePx; Error{kCancelled}.
  FilmFile(const std::filesystem::path& file, const CancellationToken* cancel);
  ~FilmFile();

  AVFormatContext* container() const { return container_.get(); }

  // The range of values that the container states of a stream, whatever its decoder says.
  AVColorRange StatedRange(const AVStream* stream) const { return ranges_[stream->index]; }

  // Only this stream is read; it is one of the container's.
  void ReadOnly(const AVStream* stream);
  // The next packet of the file; false at its end, or where it cannot be read on. Throws
  // Error{kCancelled}.
  bool ReadPacket(AVPacket* packet);

 private:
  class Bytes;

  void CheckKind(const AVInputFormat* kind) const;
  void CheckSizes() const;
  void FindStreams();
  [[noreturn]] void RefuseContainer(int libav_result) const;
  void ThrowIfCancelled() const;

  const std::filesystem::path file_;
  const CancellationToken* const cancel_;
  std::unique_ptr<Bytes> bytes_;  // outlives container_
  std::unique_ptr<AVFormatContext, CloseFilm> container_;
  std::vector<AVColorRange> ranges_;  // by stream
};

}  // namespace color3d
