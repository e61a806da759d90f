// Frames of a film, decoded on demand, and their damage. For this folder only.
#pragma once

#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <vector>

#include "core/video/film_index.h"
#include "core/video/film_packets.h"
#include "core/video/libav.h"

namespace color3d {

// Not thread-safe.
class FilmDecoder {
 public:
  // Reads the file once. Throws as FilmReader does. `cancel` may be null and must outlive this
  // object.
  FilmDecoder(std::filesystem::path file, const CancellationToken* cancel);

  const FilmPackets& packets() const { return *packets_; }
  const AVCodecContext& codec() const { return *codec_; }
  const FilmIndex& index() const { return index_; }

  // Decodes up to `frame`; returns false if it is damaged. The frame after the last one is the
  // cheapest. Throws Error{kCancelled}.
  bool Decode(int frame);
  // The frame decoded last, damaged or not.
  const AVFrame& picture() const { return *picture_; }

 private:
  struct Waiting {
    int packet;
    bool is_flagged;
    std::unique_ptr<AVFrame, FreeFrame> picture;
  };

  void StartAt(int packet);
  bool SeekTo(int packet, int goal);
  bool ReadUpTo(int packet, bool to_the_end);
  bool HasSizeAndPosition(int packet) const;
  bool IsPacket(int packet) const;
  int PlacedBefore(int packet) const;
  int Recognize();
  bool Feed();
  bool Receive();
  void Take(std::unique_ptr<AVFrame, FreeFrame> picture);
  void MarkMissingUpTo(int frame);
  bool Await();
  bool Find(int frame);

  int GroupOf(int packet) const;
  int FirstPacketOf(int group) const;
  void NoteDamage(int packet);
  bool IsBroken(int packet) const;

  const std::filesystem::path file_;
  const CancellationToken* const cancel_;
  std::unique_ptr<FilmPackets> packets_;
  std::unique_ptr<AVPacket, FreePacket> packet_;
  std::unique_ptr<AVFrame, FreeFrame> picture_;
  FilmIndex index_;
  std::unique_ptr<AVCodecContext, FreeCodec> codec_;
  std::vector<bool> is_damaged_;  // frames known to be damaged
  int tried_again_ = -2;          // group
  int at_ = -1;                   // frame of picture_; -1: none
  bool is_whole_ = false;         // picture_ is undamaged

  // A run: packets decoded one after the other.
  int begin_ = -1;               // its first packet; -1: there is none
  int next_ = 0;                 // packet that comes next
  bool has_packet_ = false;      // it lies in packet_
  bool has_ended_ = false;       // nothing more comes
  int passed_ = -1;              // last frame output
  int reached_ = -1;             // last frame requested or skipped
  std::deque<Waiting> waiting_;  // output before their damage is known
  std::map<int, int> damage_;    // by group: its first damaged packet
};

}  // namespace color3d
