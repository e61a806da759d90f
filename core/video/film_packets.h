// The packets of a film's pictures, as its file holds them. For this folder only.
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
  // Streams of pictures in the file; stream() is the one that players show.
  int stream_count() const { return stream_count_; }
  // The range of values that the container states, whatever the decoder says.
  AVColorRange stated_range() const { return file_.StatedRange(stream_); }
  const AVCodecParameters& codec() const {
    return filter_ ? *filter_->par_out : *stream_->codecpar;
  }

  // The next one, never empty; false at the end. Throws Error{kCancelled}.
  bool Read(AVPacket* packet);
  // Goes to a key packet at or before `stamp`, in most containers a time of decoding; the wrong one
  // where the container knows no better. False where it cannot.
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
  std::map<int64_t, std::string> palettes_;           // that packets brought, by their place
  bool has_ended_ = false;                            // the file; filter_ may still hold some
};

}  // namespace color3d
