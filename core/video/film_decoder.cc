#include "core/video/film_decoder.h"

#include <algorithm>
#include <utility>

#include "core/base/error.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Decoders delay up to 16 pictures; longer queues mean invalid timestamps.
constexpr size_t kMostWaiting = 32;
constexpr size_t kFewestWaiting = 4;
constexpr size_t kWaitingBytes = size_t{512} << 20;
size_t MaxQueuedPackets(const AVCodecContext& codec) {
  const auto pixels = static_cast<size_t>(std::max(codec.width, 1)) * std::max(codec.height, 1);
  return std::clamp(kWaitingBytes / (3 * pixels), kFewestWaiting, kMostWaiting);
}

// After damage in the file, packets may differ from those of the index.
constexpr int kResyncPackets = 250;

// In other codecs packets may legitimately produce no picture: a repeat, or a picture that is never
// shown.
bool IsIntraOnly(AVCodecID codec) {
  return codec == AV_CODEC_ID_H264 || codec == AV_CODEC_ID_HEVC ||
         codec == AV_CODEC_ID_MPEG2VIDEO || codec == AV_CODEC_ID_MPEG1VIDEO;
}

}  // namespace

FilmDecoder::FilmDecoder(fs::path file, const CancellationToken* cancel)
    : file_(std::move(file)),
      cancel_(cancel),
      packets_(std::make_unique<FilmPackets>(file_, cancel)),
      packet_(av_packet_alloc()),
      picture_(av_frame_alloc()),
      index_(IndexFilm(packets_.get())),
      is_damaged_(index_.stamps.size()) {
  if (index_.packets.empty()) {
    RefuseFilm(file_,
               "it holds no frame; a movie that refers to frames in other files must be saved as "
               "one that has them itself");
  }
  if (index_.stamps.empty()) {
    RefuseFilm(file_, "its frames have no times; put it into a container, e.g. .mp4");
  }
  const AVCodecParameters& parameters = packets_->codec();
  const AVCodec* decoder = avcodec_find_decoder(parameters.codec_id);
  if (decoder == nullptr) {
    RefuseFilm(file_,
               std::string("FFmpeg's libraries here have no decoder for ") +
                   avcodec_get_name(parameters.codec_id));
  }
  codec_.reset(avcodec_alloc_context3(decoder));
  if (codec_) codec_->max_pixels = kMaxFilmPixels;
  if (!codec_ || avcodec_parameters_to_context(codec_.get(), &parameters) < 0 ||
      avcodec_open2(codec_.get(), decoder, nullptr) < 0) {
    RefuseFilm(file_, std::string("its decoder ") + decoder->name + " does not open");
  }
  codec_->pkt_timebase = packets_->stream()->time_base;
  if (index_.keys.empty() || index_.keys.front() == 0) return;
  // The key packet of the group within which a recording began is missing.
  for (size_t frame = 0; frame < is_damaged_.size(); ++frame) {
    is_damaged_[frame] = GroupOf(index_.packet_of_frame[frame]) < 0;
  }
}

// A group: a key packet and the packets up to the next one. -1: before the first key packet.
// Pictures shown before the key packet are predicted from the previous group and count as part of
// it.
int FilmDecoder::GroupOf(int packet) const {
  const auto after = std::upper_bound(index_.keys.begin(), index_.keys.end(), packet);
  const int group = static_cast<int>(after - index_.keys.begin()) - 1;
  return index_.packets[packet].is_leading ? group - 1 : group;
}

int FilmDecoder::FirstPacketOf(int group) const { return group < 0 ? 0 : index_.keys[group]; }

void FilmDecoder::NoteDamage(int packet) {
  if (packet < 0) return;
  const auto [first, is_new] = damage_.try_emplace(GroupOf(packet), packet);
  if (!is_new) first->second = std::min(first->second, packet);
}

// Returns true if the frame, or one that it may be predicted from, is known to be damaged.
bool FilmDecoder::IsBroken(int packet) const {
  const auto is_hit = [&](int group) {
    const auto first = damage_.find(group);
    return first != damage_.end() && first->second <= packet;
  };
  const int group = GroupOf(packet);
  return is_hit(group) || (index_.packets[packet].is_leading && is_hit(group + 1));
}

bool FilmDecoder::HasSizeAndPosition(int packet) const {
  const FilmPacket& that = index_.packets[packet];
  return packet_->size == that.size && packet_->pos == that.pos;
}

// Positions are preferred to decoding times, which differ after a seek in Matroska.
bool FilmDecoder::IsPacket(int packet) const {
  const FilmPacket& that = index_.packets[packet];
  return HasSizeAndPosition(packet) && (that.is_placed || packet_->dts == that.dts);
}

// The nearest packet up to `packet` with a unique position; `packet` without one: it is then
// recognized by its time.
int FilmDecoder::PlacedBefore(int packet) const {
  int placed = packet;
  while (placed > 0 && !index_.packets[placed].is_placed) --placed;
  return index_.packets[placed].is_placed ? placed : packet;
}

// Reads up to `packet`, which stays in packet_. Returns false if it is not found or, without
// `to_the_end`, if the packet read is already behind it.
bool FilmDecoder::ReadUpTo(int packet, bool to_the_end) {
  int placed = PlacedBefore(packet);
  const FilmPacket& that = index_.packets[placed];
  const int64_t dts = that.dts != AV_NOPTS_VALUE ? that.dts : that.stamp;
  while (true) {
    if (!packets_->Read(packet_.get())) return false;
    if (IsPacket(placed)) break;
    const bool is_past =
        that.is_placed && packet_->pos >= 0 ? packet_->pos > that.pos : packet_->dts > dts;
    av_packet_unref(packet_.get());
    if (is_past && !to_the_end) return false;
  }
  for (; placed < packet; ++placed) {
    av_packet_unref(packet_.get());
    if (!packets_->Read(packet_.get())) return false;
  }
  has_packet_ = HasSizeAndPosition(packet);
  return has_packet_;
}

// Looks for `goal` from `packet` on.
bool FilmDecoder::SeekTo(int packet, int goal) {
  const FilmPacket& target = index_.packets[packet];
  const bool by_stamp = (packets_->container()->iformat->flags & AVFMT_SEEK_TO_PTS) != 0;
  const int64_t stamp = by_stamp || target.dts == AV_NOPTS_VALUE ? target.stamp : target.dts;
  av_packet_unref(packet_.get());
  return packets_->Seek(stamp) && ReadUpTo(goal, /*to_the_end=*/false);
}

// Starts a run.
void FilmDecoder::StartAt(int packet) {
  avcodec_flush_buffers(codec_.get());
  waiting_.clear();
  damage_.clear();
  has_packet_ = false;
  begin_ = next_ = packet;
  passed_ = reached_ = packet == 0 ? -1 : index_.packets[packet].frame - 1;
  // Files in which some pictures have no decoding time may need several attempts.
  const int placed = PlacedBefore(packet);
  const int before = FirstPacketOf(std::max(-1, GroupOf(placed) - 1));
  if (!SeekTo(placed, packet) && !SeekTo(before, packet)) {
    av_packet_unref(packet_.get());
    packets_ = std::make_unique<FilmPackets>(file_, cancel_);
    ReadUpTo(packet, /*to_the_end=*/true);
  }
  has_ended_ = !has_packet_;
}

// Index of the packet in packet_; -1: unknown.
int FilmDecoder::Recognize() {
  if (next_ < static_cast<int>(index_.packets.size()) && HasSizeAndPosition(next_)) return next_;
  const int end = std::min(next_ + kResyncPackets, static_cast<int>(index_.packets.size()));
  for (int packet = next_; packet < end; ++packet) {
    if (IsPacket(packet)) return packet;
  }
  return -1;
}

// Sends the decoder the next packet, or the end; returns false if it takes no more.
bool FilmDecoder::Feed() {
  if (!has_packet_ && !packets_->Read(packet_.get())) {
    return avcodec_send_packet(codec_.get(), nullptr) >= 0;
  }
  has_packet_ = false;
  const int packet = Recognize();
  // Identifies the picture when it is output.
  packet_->pts = packet < 0 ? AV_NOPTS_VALUE : packet;
  packet_->dts = AV_NOPTS_VALUE;
  if (packet != next_ && next_ < static_cast<int>(index_.packets.size())) NoteDamage(next_);
  if (packet >= 0) next_ = packet + 1;
  const bool is_torn = packet >= 0 && index_.packets[packet].is_torn;
  if (avcodec_send_packet(codec_.get(), packet_.get()) < 0 || is_torn) NoteDamage(packet);
  av_packet_unref(packet_.get());
  return true;
}

// Marks frames up to `frame` that were not output as missing.
void FilmDecoder::MarkMissingUpTo(int frame) {
  if (IsIntraOnly(codec_->codec_id)) {
    for (int missing = passed_ + 1; missing < frame; ++missing) {
      NoteDamage(index_.packet_of_frame[missing]);
    }
  }
  passed_ = frame;
}

// Queues the decoder's output.
void FilmDecoder::Take(std::unique_ptr<AVFrame, FreeFrame> picture) {
  const int64_t packet = picture->pts;
  if (packet < begin_ || packet >= static_cast<int64_t>(index_.packets.size())) return;
  const bool is_flagged =
      picture->decode_error_flags != 0 || (picture->flags & AV_FRAME_FLAG_CORRUPT) != 0;
  if (is_flagged) NoteDamage(static_cast<int>(packet));
  const FilmPacket& from = index_.packets[packet];
  if (!from.is_shown || from.frame <= passed_) return;
  MarkMissingUpTo(from.frame);
  waiting_.push_back({static_cast<int>(packet), is_flagged, std::move(picture)});
}

// Advances the decoder by a picture; returns false at the end.
bool FilmDecoder::Receive() {
  while (!has_ended_) {
    std::unique_ptr<AVFrame, FreeFrame> picture(av_frame_alloc());
    const int result = avcodec_receive_frame(codec_.get(), picture.get());
    if (result == 0) {
      Take(std::move(picture));
      return true;
    }
    if (result != AVERROR_EOF && result != AVERROR(EAGAIN)) NoteDamage(next_ - 1);
    if (result == AVERROR_EOF || !Feed()) {
      has_ended_ = true;
      MarkMissingUpTo(static_cast<int>(index_.stamps.size()));
    }
  }
  return false;
}

// Waits until the first of waiting_ exists and its damage is known; a frame that it is predicted
// from may be shown after it. Returns false at the end.
bool FilmDecoder::Await() {
  while (waiting_.empty() || (passed_ < index_.packets[waiting_.front().packet].latest &&
                              waiting_.size() < MaxQueuedPackets(*codec_))) {
    if (!Receive()) break;
  }
  return !waiting_.empty();
}

// Takes `frame` from the run; returns false if it is damaged.
bool FilmDecoder::Find(int frame) {
  reached_ = frame;
  while (Await()) {
    Waiting& first = waiting_.front();
    // A later picture in its place is kept for its own frame.
    if (index_.packets[first.packet].frame > frame) return false;
    picture_ = std::move(first.picture);
    at_ = index_.packets[first.packet].frame;
    is_whole_ = !first.is_flagged && !IsBroken(first.packet);
    waiting_.pop_front();
    if (at_ == frame) return is_whole_;
  }
  return false;
}

bool FilmDecoder::Decode(int frame) {
  if (at_ == frame) return is_whole_;
  if (is_damaged_[frame]) return false;
  const int group = GroupOf(index_.packet_of_frame[frame]);
  const int start = FirstPacketOf(group);
  const bool goes_on = begin_ >= 0 && begin_ <= start && reached_ < frame &&
                       reached_ >= index_.packets[start].frame - 1;
  if (!goes_on) StartAt(start);
  bool is_whole = Find(frame);
  // A key packet may depend on earlier packets after all, and decoders learn during decoding how
  // many pictures they must delay.
  if (!is_whole && ((begin_ == start && start > 0) || group != tried_again_)) {
    tried_again_ = group;
    StartAt(FirstPacketOf(group - 1));
    is_whole = Find(frame);
  }
  is_damaged_[frame] = !is_whole;
  return is_whole;
}

}  // namespace color3d
