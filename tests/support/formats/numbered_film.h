// Films whose frames show their number, of any codec and container, by FFmpeg's libraries.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/image.h"

namespace color3d {

struct NumberedFilm {
  std::string encoder = "libx264";  // FFmpeg's name
  int frames = 60;                  // 128 at most
  int group = 12;                   // frames from a key frame to the next
  int b_frames = 2;                 // between others
  // MPEG-4 with one B picture at a time, as DivX has it: in the packet of the one that is shown
  // after it, and an empty packet in its place.
  bool is_packed = false;
  // Nothing but the number in the picture: some containers put several such frames into a pack.
  bool is_flat = false;
};

// 96 x 64 px at 25 frames a second; the ending of `file` selects the container. Below the number
// a texture moves. False where FFmpeg's libraries here have no such encoder. Throws
// std::runtime_error.
bool WriteNumberedFilm(const std::filesystem::path& file, const NumberedFilm& film);

// The same as H.264 of two fields a frame that are coded apart, as video cameras do it, and nothing
// but the number: in packets of their own, or in one.
void WriteFieldFilm(const std::filesystem::path& file, int frames, bool one_packet);

int NumberOf(const Image& frame);

struct PacketPlace {
  int64_t pos = 0;
  int size = 0;  // bytes; the container may have put its own between them
};

// In the order in which they are decoded.
std::vector<PacketPlace> PacketsOf(const std::filesystem::path& film);

}  // namespace color3d
