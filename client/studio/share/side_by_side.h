// A movie beside itself without colour. Thread-safe.
#pragma once

#include <filesystem>

#include "core/base/cancellation.h"

namespace color3d::client {

// Writes an MP4 with every frame of `movie` twice: in grey on the left, in colour on the right,
// with its times and its sound. Wide frames are reduced to the largest size of a movie. Throws
// Error as FilmReader and Mp4Writer.
void WriteSideBySide(const std::filesystem::path& movie,
                     const std::filesystem::path& to,
                     const CancellationToken& cancel);

}  // namespace color3d::client
