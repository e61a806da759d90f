// Opens a film's file as a single file of a supported container. Never opens other files, addresses
// or devices that it references. For this folder only.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/video/libav.h"

namespace color3d {

// Throws Error{kInvalidArgument} with the file's name; `why` it is not a film.
[[noreturn]] void RefuseFilm(const std::filesystem::path& file, const std::string& why);

// Limit for the frames of a film; larger ones are never decoded.
inline constexpr int kMaxFilmSidePx = 8192;
inline constexpr int64_t kMaxFilmPixels = int64_t{kMaxFilmSidePx} * kMaxFilmSidePx;

// Not thread-safe.
class FilmFile {
 public:
  // Opens the file and finds its streams. FFmpeg's libraries receive its bytes from this class and
  // can open nothing else. `cancel` may be null; it must outlive this object and interrupts the
  // libraries. Throws Error{kNotFound} if there is no such regular file; Error{kInvalidArgument}
  // with the file's name and type if it is no film container or its frames are larger than
  // kMaxFilmSidePx; Error{kCancelled}.
  FilmFile(const std::filesystem::path& file, const CancellationToken* cancel);
  ~FilmFile();

  AVFormatContext* container() const { return container_.get(); }

  // The value range that the container states for a stream, regardless of the decoder.
  AVColorRange StatedRange(const AVStream* stream) const { return ranges_[stream->index]; }

  // Restricts reading to this stream of the container.
  void ReadOnly(const AVStream* stream);
  // Reads the next packet; returns false at the end of the file or where reading fails. Throws
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
