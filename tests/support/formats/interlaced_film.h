// Interlaced films (two fields per frame), encoded by FFmpeg's libraries.
#pragma once

#include <filesystem>
#include <functional>

namespace color3d {

// Grey in 0..1 of a column in all lines of a field. Field 0: even lines, shown first; 1: odd lines.
using FieldGray = std::function<double(int frame, int field, int x)>;

// Writes MPEG-2 at 25 frames per second; the ending of `file` selects the container. Throws
// std::runtime_error.
void WriteInterlacedFilm(
    const std::filesystem::path& file, int width, int height, int frames, const FieldGray& gray);

}  // namespace color3d
