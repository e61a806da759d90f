#include "core/video/film_index.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <memory>

#include "core/base/error.h"

namespace color3d {
namespace {

struct CloseParser {
  void operator()(AVCodecParserContext* parser) const { av_parser_close(parser); }
};

// A larger step back in decoding time means concatenated films.
constexpr double kFallbackS = 1.0;
constexpr size_t kMostPackets = 4'000'000;  // more than any part and stride needs

struct Scanned {
  FilmPacket packet;
  int64_t dts = AV_NOPTS_VALUE;  // continuous over concatenated films
  // Read from the picture's header, if parsed:
  bool is_b = false;         // shown as soon as it is decoded
  int number = 0;            // presentation number since the last restart
  bool begins_anew = false;  // numbers restart at this picture
  bool is_second = false;    // second field of the previous packet's frame
};

// Presentation order follows picture numbers; B pictures may be reference pictures.
bool HasNumbers(AVCodecID codec) { return codec == AV_CODEC_ID_H264 || codec == AV_CODEC_ID_HEVC; }

bool HasTypes(AVCodecID codec) {
  return codec == AV_CODEC_ID_MPEG4 || codec == AV_CODEC_ID_MPEG2VIDEO ||
         codec == AV_CODEC_ID_MPEG1VIDEO;
}

// Reads the headers of pictures.
class PictureHeaders {
 public:
  explicit PictureHeaders(const AVCodecParameters& codec) : kind_(codec.codec_id) {
    if (!HasNumbers(kind_) && !HasTypes(kind_)) return;
    codec_.reset(avcodec_alloc_context3(nullptr));
    if (!codec_ || avcodec_parameters_to_context(codec_.get(), &codec) < 0) return;
    parser_.reset(av_parser_init(kind_));
    if (parser_) parser_->flags |= PARSER_FLAG_COMPLETE_FRAMES;
  }

  void Read(const AVPacket& packet, Scanned* picture) {
    picture->is_b = packet.pts != AV_NOPTS_VALUE && packet.pts == packet.dts;
    if (!parser_) return;
    uint8_t* data = nullptr;
    int size = 0;
    av_parser_parse2(parser_.get(),
                     codec_.get(),
                     &data,
                     &size,
                     packet.data,
                     packet.size,
                     packet.pts,
                     packet.dts,
                     packet.pos);
    picture->is_b = parser_->pict_type == AV_PICTURE_TYPE_B;
    if (!HasNumbers(kind_)) return;
    const int number = parser_->output_picture_number;
    picture->number = number;
    picture->begins_anew = parser_->key_frame == 1 && number == 0;
    if (kind_ != AV_CODEC_ID_H264) return;
    const AVPictureStructure field = parser_->picture_structure;
    picture->is_second = ((field == AV_PICTURE_STRUCTURE_TOP_FIELD &&
                           first_field_ == AV_PICTURE_STRUCTURE_BOTTOM_FIELD) ||
                          (field == AV_PICTURE_STRUCTURE_BOTTOM_FIELD &&
                           first_field_ == AV_PICTURE_STRUCTURE_TOP_FIELD)) &&
                         std::abs(number - last_number_) <= 1;
    first_field_ = picture->is_second ? AV_PICTURE_STRUCTURE_UNKNOWN : field;
    last_number_ = number;
  }

 private:
  const AVCodecID kind_;
  std::unique_ptr<AVCodecContext, FreeCodec> codec_;
  std::unique_ptr<AVCodecParserContext, CloseParser> parser_;
  AVPictureStructure first_field_ = AV_PICTURE_STRUCTURE_UNKNOWN;  // of a frame that lacks another
  int last_number_ = 0;
};

// Shifts concatenated films so that each begins where the previous one ends.
void JoinConcatenatedTimes(double tick, std::vector<Scanned>* scanned) {
  int64_t rise = 0, last = AV_NOPTS_VALUE, step = 0;
  for (Scanned& picture : *scanned) {
    const int64_t dts = picture.packet.dts;
    if (dts != AV_NOPTS_VALUE) {
      const int64_t further = last == AV_NOPTS_VALUE ? 0 : dts - last;
      if (static_cast<double>(-further) * tick > kFallbackS) rise += step - further;
      if (further > 0) step = further;
      last = dts;
      picture.dts += rise;
    }
    if (picture.packet.stamp != AV_NOPTS_VALUE) picture.packet.stamp += rise;
  }
}

bool HasNoStamp(const Scanned* picture) { return picture->packet.stamp == AV_NOPTS_VALUE; }

int64_t MeanStep(int64_t first, int64_t last, size_t steps) {
  return steps == 0 ? 0 : (last - first) / static_cast<int64_t>(steps);
}

// A B picture is shown when it is decoded, any other picture when the next one that is not B is
// decoded. Without B pictures, pictures are shown as they are decoded.
void StampByType(const std::vector<Scanned*>& pictures, bool has_b) {
  int64_t next = pictures.back()->dts;
  if (next != AV_NOPTS_VALUE && pictures.front()->dts != AV_NOPTS_VALUE) {
    next += MeanStep(pictures.front()->dts, next, pictures.size() - 1);
  }
  for (auto at = pictures.rbegin(); at != pictures.rend(); ++at) {
    Scanned& picture = **at;
    if (HasNoStamp(&picture)) picture.packet.stamp = picture.is_b || !has_b ? picture.dts : next;
    if (!picture.is_b) next = picture.dts;
  }
}

// In presentation order.
std::vector<Scanned*> ByNumber(std::vector<Scanned*> pictures) {
  for (auto begin = pictures.begin(); begin != pictures.end();) {
    const auto end = std::find_if(
        begin + 1, pictures.end(), [](const Scanned* picture) { return picture->begins_anew; });
    std::stable_sort(
        begin, end, [](const Scanned* x, const Scanned* y) { return x->number < y->number; });
    begin = end;
  }
  return pictures;
}

// H.264 in AVI has decoding times, but no presentation times: the same times are assigned in the
// order `shown`, `delay` pictures later or as late as necessary for no picture to be shown before
// it is decoded.
void AssignStamps(const std::vector<Scanned*>& decoded,
                  const std::vector<Scanned*>& shown,
                  int delay) {
  std::vector<int64_t> stamps;
  for (const Scanned* picture : decoded) stamps.push_back(picture->dts);
  std::sort(stamps.begin(), stamps.end());
  int64_t late = delay * MeanStep(stamps.front(), stamps.back(), stamps.size() - 1);
  for (size_t i = 0; i < shown.size(); ++i) late = std::max(late, shown[i]->dts - stamps[i]);
  for (size_t i = 0; i < shown.size(); ++i) shown[i]->packet.stamp = stamps[i] + late;
}

// Pictures without a timestamp are spread evenly between those with one. (A timestamp out of order
// belongs to another picture of the pack.)
void SpreadStamps(const std::vector<Scanned*>& shown) {
  std::vector<size_t> known;
  for (size_t i = 0; i < shown.size(); ++i) {
    FilmPacket& packet = shown[i]->packet;
    if (!known.empty() && packet.stamp <= shown[known.back()]->packet.stamp) {
      packet.stamp = AV_NOPTS_VALUE;
    }
    if (packet.stamp != AV_NOPTS_VALUE) known.push_back(i);
  }
  if (known.size() < 2) return;
  for (size_t i = 0; i < shown.size(); ++i) {
    if (!HasNoStamp(shown[i])) continue;
    const auto after = std::lower_bound(known.begin() + 1, known.end() - 1, i);
    const auto from = static_cast<int64_t>(*(after - 1)), to = static_cast<int64_t>(*after);
    const int64_t begin = shown[from]->packet.stamp, end = shown[to]->packet.stamp;
    shown[i]->packet.stamp = begin + (end - begin) * (static_cast<int64_t>(i) - from) / (to - from);
  }
}

void StampPictures(std::vector<Scanned>* scanned, const AVCodecParameters& codec) {
  std::vector<Scanned*> pictures;
  for (Scanned& picture : *scanned) {
    if (!picture.is_second) pictures.push_back(&picture);
  }
  const auto has_dts = [](const Scanned* picture) { return picture->dts != AV_NOPTS_VALUE; };
  if (std::any_of(pictures.begin(), pictures.end(), HasNoStamp)) {
    if (!HasNumbers(codec.codec_id)) {
      StampByType(pictures, codec.video_delay > 0);
    } else if (!std::all_of(pictures.begin(), pictures.end(), HasNoStamp)) {
      SpreadStamps(ByNumber(pictures));
    } else if (std::all_of(pictures.begin(), pictures.end(), has_dts)) {
      AssignStamps(pictures, ByNumber(pictures), codec.video_delay);
    }
  }
  int64_t last = 0;
  for (Scanned& picture : *scanned) {
    FilmPacket& packet = picture.packet;
    if (packet.stamp == AV_NOPTS_VALUE) packet.stamp = picture.dts;
    if (picture.is_second || packet.stamp == AV_NOPTS_VALUE) {
      packet.is_shown = packet.is_key = false;
      packet.stamp = last;
    }
    last = packet.stamp;
  }
}

void FindPlaced(std::vector<FilmPacket>* packets) {
  std::vector<int64_t> places;
  for (const FilmPacket& packet : *packets) places.push_back(packet.pos);
  std::sort(places.begin(), places.end());
  for (FilmPacket& packet : *packets) {
    const auto [first, last] = std::equal_range(places.begin(), places.end(), packet.pos);
    packet.is_placed = packet.pos >= 0 && last - first == 1;
  }
}

// Derives frames, keys and other fields from the timestamps.
void NumberFrames(FilmIndex* index) {
  std::vector<int64_t>& stamps = index->stamps;
  for (const FilmPacket& packet : index->packets) {
    if (packet.is_shown) stamps.push_back(packet.stamp);
  }
  std::sort(stamps.begin(), stamps.end());
  stamps.erase(std::unique(stamps.begin(), stamps.end()), stamps.end());
  index->packet_of_frame.assign(stamps.size(), -1);
  int latest = -1;
  for (size_t i = 0; i < index->packets.size(); ++i) {
    FilmPacket& packet = index->packets[i];
    packet.frame = static_cast<int>(std::lower_bound(stamps.begin(), stamps.end(), packet.stamp) -
                                    stamps.begin());
    if (packet.is_key) {
      index->keys.push_back(static_cast<int>(i));
      latest = -1;  // earlier packets do not affect later ones
    }
    packet.is_leading =
        !index->keys.empty() && packet.stamp < index->packets[index->keys.back()].stamp;
    if (packet.is_shown) {
      latest = std::max(latest, packet.frame);
      int& first = index->packet_of_frame[packet.frame];
      if (first < 0) first = static_cast<int>(i);
    }
    packet.latest = latest;
  }
  // MPEG-TS reports it one packet early, before the truncated packet is complete.
  for (size_t i = index->packets.size() - 1; i > 0; --i) {
    index->packets[i].is_torn |= index->packets[i - 1].is_torn;
  }
}

}  // namespace

FilmIndex IndexFilm(FilmPackets* packets) {
  FilmIndex index;
  PictureHeaders headers(packets->codec());
  const std::unique_ptr<AVPacket, FreePacket> packet(av_packet_alloc());
  std::vector<Scanned> scanned;
  while (packets->Read(packet.get())) {
    if (scanned.size() == kMostPackets) {
      throw InvalidArgument("the film has more than {} pictures; cut it into parts", kMostPackets);
    }
    Scanned next;
    headers.Read(*packet, &next);
    next.packet.pos = packet->pos;
    next.packet.dts = next.dts = packet->dts;
    next.packet.stamp = packet->pts;
    next.packet.size = packet->size;
    next.packet.is_key = (packet->flags & AV_PKT_FLAG_KEY) != 0;
    next.packet.is_torn = (packet->flags & AV_PKT_FLAG_CORRUPT) != 0;
    // Pictures cut off by an edit list are decoded for the following ones, and never shown.
    next.packet.is_shown = (packet->flags & AV_PKT_FLAG_DISCARD) == 0;
    if (!next.is_second && packet->duration > 0) index.last_duration = packet->duration;
    scanned.push_back(next);
    av_packet_unref(packet.get());
  }
  if (scanned.empty()) return index;
  if (packets->container()->iformat->flags & AVFMT_TS_DISCONT) {
    JoinConcatenatedTimes(av_q2d(packets->stream()->time_base), &scanned);
  } else {
    // Only recordings begin between key packets; in other files the first packet just lacks the
    // flag.
    scanned.front().packet.is_key = true;
  }
  StampPictures(&scanned, packets->codec());
  for (const Scanned& picture : scanned) index.packets.push_back(picture.packet);
  FindPlaced(&index.packets);
  NumberFrames(&index);
  return index;
}

}  // namespace color3d
