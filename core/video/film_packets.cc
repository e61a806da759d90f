#include "core/video/film_packets.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Picture streams, without cover art and thumbnails.
std::vector<AVStream*> FilmStreams(AVFormatContext* container) {
  std::vector<AVStream*> streams;
  for (unsigned i = 0; i < container->nb_streams; ++i) {
    AVStream* stream = container->streams[i];
    if (stream->codecpar->codec_type == AVMEDIA_TYPE_VIDEO &&
        (stream->disposition & (AV_DISPOSITION_ATTACHED_PIC | AV_DISPOSITION_TIMED_THUMBNAILS)) ==
            0) {
      streams.push_back(stream);
    }
  }
  return streams;
}

// Players take the stream marked as default; among several, or without one, the largest, and among
// equals the first.
bool IsPreferred(const AVStream* one, const AVStream* other) {
  const auto rank = [](const AVStream* stream) {
    return std::pair((stream->disposition & AV_DISPOSITION_DEFAULT) != 0,
                     int64_t{stream->codecpar->width} * stream->codecpar->height);
  };
  return rank(one) > rank(other);
}

}  // namespace

FilmPackets::FilmPackets(const fs::path& file, const CancellationToken* cancel)
    : file_(file, cancel) {
  const std::vector<AVStream*> streams = FilmStreams(container());
  if (streams.empty()) RefuseFilm(file, "it has no pictures, perhaps only sound");
  stream_count_ = static_cast<int>(streams.size());
  stream_ = *std::min_element(streams.begin(), streams.end(), IsPreferred);
  file_.ReadOnly(stream_);
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

// Containers store a palette once, with the first packet that uses it, and not again after a seek.
void FilmPackets::KeepPalette(AVPacket* packet) {
  size_t size = 0;
  const uint8_t* palette = av_packet_get_side_data(packet, AV_PKT_DATA_PALETTE, &size);
  if (palette != nullptr) {
    palettes_[packet->pos].assign(reinterpret_cast<const char*>(palette), size);
    return;
  }
  auto last = palettes_.upper_bound(packet->pos);
  if (last == palettes_.begin()) return;
  const std::string& bytes = (--last)->second;
  if (uint8_t* copy = av_packet_new_side_data(packet, AV_PKT_DATA_PALETTE, bytes.size())) {
    std::memcpy(copy, bytes.data(), bytes.size());
  }
}

// The next packet of the pictures; false at the end.
bool FilmPackets::ReadFile(AVPacket* packet) {
  while (file_.ReadPacket(packet)) {
    if (packet->stream_index == stream_->index && packet->size > 0) {
      KeepPalette(packet);
      return true;
    }
    av_packet_unref(packet);
  }
  return false;
}

bool FilmPackets::Read(AVPacket* packet) {
  while (true) {
    if (filter_ && av_bsf_receive_packet(filter_.get(), packet) >= 0) return true;
    if (has_ended_) return false;
    if (!ReadFile(packet)) {
      has_ended_ = true;
      if (filter_) av_bsf_send_packet(filter_.get(), nullptr);
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
  return av_seek_frame(container(), stream_->index, stamp, AVSEEK_FLAG_BACKWARD) >= 0;
}

}  // namespace color3d
