// Packets of a film's picture stream in file order. For this folder only.
#pragma once

extern "C" {
#include <libavcodec/bsf.h>
}

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "core/video/film_file.h"
#include "core/video/libav.h"

namespace color3d {

class FilmPackets {
 public:
  // Throws as FilmReader does. `cancel` may be null and outlives this object.
  FilmPackets(const std::filesystem::path& file, const CancellationToken* cancel);

  AVFormatContext* container() const { return file_.container(); }
  AVStream* stream() const { return stream_; }
  // Picture streams in the file; stream() is the one that players show.
  int stream_count() const { return stream_count_; }
  // The value range that the container states, regardless of the decoder.
  AVColorRange stated_range() const { return file_.StatedRange(stream_); }
  const AVCodecParameters& codec() const {
    return filter_ ? *filter_->par_out : *stream_->codecpar;
  }

  // Returns the next packet, never empty; false at the end. Throws Error{kCancelled}.
  bool Read(AVPacket* packet);
  // Seeks to a key packet at or before `stamp`, which is a decoding time in most containers; to a
  // wrong one if the container's index is wrong. Returns false if it cannot seek.
  bool Seek(int64_t stamp);

 private:
  struct FreeFilter {
    void operator()(AVBSFContext* filter) const { av_bsf_free(&filter); }
  };

  void UnpackPictures();
  bool ReadFile(AVPacket* packet);
  void KeepPalette(AVPacket* packet);

  FilmFile file_;
  AVStream* stream_ = nullptr;
  int stream_count_ = 0;
  std::unique_ptr<AVBSFContext, FreeFilter> filter_;  // may be none
  std::map<int64_t, std::string> palettes_;           // palettes of packets, by their position
  bool has_ended_ = false;                            // end of file; filter_ may still hold packets
};

}  // namespace color3d
