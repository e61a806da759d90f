// What a film's file holds, found by reading it once through without decoding it. For this folder
// only.
#pragma once

#include <cstdint>
#include <vector>

#include "core/video/film_packets.h"

namespace color3d {

// Nearly always one picture.
struct FilmPacket {
  int64_t pos = -1;                // byte of the file; -1: not told
  int64_t dts = AV_NOPTS_VALUE;    // when it is decoded, in the stream's time base
  int64_t stamp = AV_NOPTS_VALUE;  // when it is shown
  int size = 0;
  bool is_placed = false;   // no other one has its pos
  bool is_key = false;      // decoding can begin here
  bool is_shown = false;    // not: cut off by an edit list, or the second field of a frame
  bool is_torn = false;     // its container says that some of it is lost
  bool is_leading = false;  // decoded after a key packet and shown before it
  int frame = 0;            // that it is shown as; the next one, where it is not shown
  int latest = -1;          // frame: of the packets up to here the one that is shown last
};

struct FilmIndex {
  std::vector<FilmPacket> packets;   // in the order in which they are decoded
  std::vector<int> keys;             // of packets
  std::vector<int64_t> stamps;       // of the frames, strictly ascending
  std::vector<int> packet_of_frame;  // the first one
  int64_t last_duration = 0;         // 0: not told
};

// Reads the packets to their end. Pictures of one stamp are one frame; those of which nothing says
// when they are shown are none.
FilmIndex IndexFilm(FilmPackets* packets);

}  // namespace color3d
