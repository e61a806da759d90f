#include "core/video/film_packets.h"

#include "core/base/error.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// A picture in a sound file, its cover, is no film.
AVStream* FindFilm(AVFormatContext* container) {
  for (unsigned i = 0; i < container->nb_streams; ++i) {
    AVStream* stream = container->streams[i];
    if (stream->codecpar->codec_type == AVMEDIA_TYPE_VIDEO &&
        (stream->disposition & AV_DISPOSITION_ATTACHED_PIC) == 0) {
      return stream;
    }
  }
  return nullptr;
}

[[noreturn]] void RefuseContainer(const fs::path& file, int libav_result) {
  RefuseFilm(file,
             LibavError(libav_result) +
                 "; it may be damaged or cut short: try another copy, or save it as .mp4 with a "
                 "program that plays it");
}

}  // namespace

void RefuseFilm(const fs::path& file, const std::string& why) {
  throw InvalidArgument("{} is no film that can be read: {}", file.filename().string(), why);
}

FilmPackets::FilmPackets(const fs::path& file) {
  av_log_set_level(AV_LOG_FATAL);
  if (!fs::is_regular_file(file)) {
    throw Error(ErrorCode::kNotFound, "there is no film {}", file.string());
  }
  AVFormatContext* container = nullptr;
  if (const int result = avformat_open_input(&container, file.c_str(), nullptr, nullptr);
      result < 0) {
    RefuseContainer(file, result);
  }
  container_.reset(container);
  if (const int result = avformat_find_stream_info(container, nullptr); result < 0) {
    RefuseContainer(file, result);
  }
  stream_ = FindFilm(container);
  if (stream_ == nullptr) RefuseFilm(file, "it has no pictures, perhaps only sound");
  for (unsigned i = 0; i < container->nb_streams; ++i) {
    if (container->streams[i] != stream_) container->streams[i]->discard = AVDISCARD_ALL;
  }
  if (stream_->codecpar->codec_id == AV_CODEC_ID_MPEG4) UnpackPictures();
}

// AVI of DivX and Xvid may hold two pictures in a packet, and an empty one in the next.
void FilmPackets::UnpackPictures() {
  const AVBitStreamFilter* kind = av_bsf_get_by_name("mpeg4_unpack_bframes");
  AVBSFContext* filter = nullptr;
  if (kind == nullptr || av_bsf_alloc(kind, &filter) < 0) return;
  filter_.reset(filter);
  if (avcodec_parameters_copy(filter->par_in, stream_->codecpar) < 0 || av_bsf_init(filter) < 0) {
    filter_.reset();
  }
}

bool FilmPackets::Read(AVPacket* packet) {
  while (true) {
    if (filter_ && av_bsf_receive_packet(filter_.get(), packet) >= 0) return true;
    if (has_ended_) return false;
    if (av_read_frame(container_.get(), packet) < 0) {
      has_ended_ = true;
      if (filter_) av_bsf_send_packet(filter_.get(), nullptr);
    } else if (packet->stream_index != stream_->index || packet->size == 0) {
      av_packet_unref(packet);
    } else if (!filter_) {
      return true;
    } else if (av_bsf_send_packet(filter_.get(), packet) < 0) {
      av_packet_unref(packet);
    }
  }
}

bool FilmPackets::Seek(int64_t stamp) {
  if (filter_) av_bsf_flush(filter_.get());
  has_ended_ = false;
  return av_seek_frame(container_.get(), stream_->index, stamp, AVSEEK_FLAG_BACKWARD) >= 0;
}

}  // namespace color3d
