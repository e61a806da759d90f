// Index of a film's packets and frames, built by reading the file once without decoding it. For
// this folder only.
#pragma once

#include <cstdint>
#include <vector>

#include "core/video/film_packets.h"

namespace color3d {

// A packet of the picture stream, nearly always one picture.
struct FilmPacket {
  int64_t pos = -1;                // byte offset in the file; -1: unknown
  int64_t dts = AV_NOPTS_VALUE;    // decoding time, in the stream's time base
  int64_t stamp = AV_NOPTS_VALUE;  // presentation time
  int size = 0;
  bool is_placed = false;   // its pos is unique
  bool is_key = false;      // decoding can begin here
  bool is_shown = false;    // false: cut off by an edit list, or the second field of a frame
  bool is_torn = false;     // the container marks it as incomplete
  bool is_leading = false;  // decoded after a key packet and presented before it
  int frame = 0;            // the frame that it presents; the next one if it is not shown
  int latest = -1;          // frame: the latest in presentation order of the packets up to here
};

struct FilmIndex {
  std::vector<FilmPacket> packets;   // in decoding order
  std::vector<int> keys;             // indices of packets
  std::vector<int64_t> stamps;       // of the frames, strictly ascending
  std::vector<int> packet_of_frame;  // the first one
  int64_t last_duration = 0;         // 0: unknown
};

// Reads all packets. Pictures of equal time form one frame; pictures without a time are omitted.
FilmIndex IndexFilm(FilmPackets* packets);

}  // namespace color3d
