// Owning pointers for objects of FFmpeg's libraries. For this folder only.
#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/error.h>
}

#include <string>

namespace color3d {

struct CloseFilm {
  void operator()(AVFormatContext* film) const { avformat_close_input(&film); }
};
struct FreeCodec {
  void operator()(AVCodecContext* codec) const { avcodec_free_context(&codec); }
};
struct FreeFrame {
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
};
struct FreePacket {
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};

// FFmpeg's message for `result`, < 0.
inline std::string LibavError(int result) {
  char words[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(result, words, sizeof words);
  return words;
}

}  // namespace color3d
