// The packets of a film's pictures, as its file holds them. For this folder only.
#pragma once

extern "C" {
#include <libavcodec/bsf.h>
}

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "core/video/libav.h"

namespace color3d {

// `why` it is no film: throws Error{kInvalidArgument} that names the file.
[[noreturn]] void RefuseFilm(const std::filesystem::path& file, const std::string& why);

class FilmPackets {
 public:
  // Throws as FilmReader does.
  explicit FilmPackets(const std::filesystem::path& file);

  AVFormatContext* container() const { return container_.get(); }
  AVStream* stream() const { return stream_; }
  const AVCodecParameters& codec() const {
    return filter_ ? *filter_->par_out : *stream_->codecpar;
  }

  // The next one, never empty; false at the end.
  bool Read(AVPacket* packet);
  // Goes to a key packet at or before `stamp`, in most containers a time of decoding; the wrong one
  // where the container knows no better. False where it cannot.
  bool Seek(int64_t stamp);

 private:
  struct FreeFilter {
    void operator()(AVBSFContext* filter) const { av_bsf_free(&filter); }
  };

  void UnpackPictures();

  std::unique_ptr<AVFormatContext, CloseFilm> container_;
  AVStream* stream_ = nullptr;
  std::unique_ptr<AVBSFContext, FreeFilter> filter_;  // may be none
  bool has_ended_ = false;                            // the file; filter_ may still hold some
};

}  // namespace color3d
