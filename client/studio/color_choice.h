// What the page chose for the colours of a photo.
#pragma once

#include <filesystem>
#include <string>

#include "client/lib/connection.h"
#include "color3d/v1/key_view.pb.h"

namespace color3d::client {

// Where the colours of a key photo come from, and strokes above them.
struct ColorChoice {
  enum class From { kNothing, kAutomatic, kPicture, kReference, kWords };
  From from = From::kAutomatic;
  std::filesystem::path picture;  // kPicture: the photo, coloured; kReference: another picture
  std::string words;              // kWords
  std::string strokes;            // JSON as for `key color --hints`; empty: none
};

// A photo and its colours.
struct KeyChoice {
  std::string view;  // empty: the service selects it
  ColorChoice color;
  std::filesystem::path strokes_file;  // `color.strokes`; empty: none
};

// Uploads what the choice names. `strokes`: file with its strokes; empty: without them. Throws
// Error{kFailedPrecondition} for words if the service has no model for them.
v1::KeyColorSource UploadColors(Connection& connection,
                                const ColorChoice& color,
                                const std::filesystem::path& strokes);

}  // namespace color3d::client
