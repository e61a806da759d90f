// Films of two fields a frame, as video cameras and broadcasters made them, by FFmpeg's libraries.
#pragma once

#include <filesystem>
#include <functional>

namespace color3d {

// Grey in 0..1 at a column of all lines of a field; 0: the even lines, which come first; 1: the
// odd.
using FieldGray = std::function<double(int frame, int field, int x)>;

// MPEG-2 at 25 frames a second; the ending of `file` selects the container. Throws
// std::runtime_error.
void WriteInterlacedFilm(
    const std::filesystem::path& file, int width, int height, int frames, const FieldGray& gray);

}  // namespace color3d
