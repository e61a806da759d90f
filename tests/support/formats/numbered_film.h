// Films whose frames show their number, in any codec and container, by FFmpeg's libraries.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/image.h"

namespace color3d {

struct NumberedFilm {
  std::string encoder = "libx264";  // FFmpeg's name
  int frames = 60;                  // at most 128
  int group = 12;                   // distance of intra-coded frames
  int b_frames = 2;                 // B frames between reference frames
  // MPEG-4 with one B picture at a time, packed as by DivX: in the packet of the picture shown
  // after it, with an empty packet in its place.
  bool is_packed = false;
  // Only the number in the picture: some containers put several such small frames into a pack.
  bool is_flat = false;
};

// Writes 96 x 64 px at 25 frames per second, with a moving texture below the number; the ending of
// `file` selects the container. Returns false if FFmpeg's libraries lack the encoder. Throws
// std::runtime_error.
bool WriteNumberedFilm(const std::filesystem::path& file, const NumberedFilm& film);

// The same as H.264 with separately coded fields, as by video cameras, and only the number. Fields
// have their own packets, or share one.
void WriteFieldFilm(const std::filesystem::path& file, int frames, bool one_packet);

int NumberOf(const Image& frame);

struct PacketPlace {
  int64_t pos = 0;
  int size = 0;  // bytes; may include bytes of the container
};

// In decoding order.
std::vector<PacketPlace> PacketsOf(const std::filesystem::path& film);

}  // namespace color3d
