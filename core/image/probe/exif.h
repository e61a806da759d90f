// Where EXIF data lies in a picture, and its entries. For this folder only. Pure
// functions on the caller's bytes, safe on hostile input.
#pragma once

#include <cstddef>
#include <string_view>

namespace color3d {

// The block in TIFF form: of a JPEG's APP1, a PNG's eXIf, a WebP's EXIF chunk, a HEIC's Exif item,
// or the TIFF file itself. Empty when there is none.
std::string_view FindExifBlock(std::string_view bytes);

// Where one directory of a block lies.
struct ExifDirectory {
  std::string_view block;
  size_t at = 0;
  bool big_endian = true;
};

// False when the block does not start as TIFF.
bool FirstExifDirectory(std::string_view block, ExifDirectory* directory);
// False when the directory has no entry `tag` that names a further one.
bool FurtherExifDirectory(const ExifDirectory& from, unsigned tag, ExifDirectory* directory);
// False when the first directory names no further one for the camera's settings (tag 34665).
bool PhotoExifDirectory(const ExifDirectory& first, ExifDirectory* directory);

// Offset in the block of the 12-byte entry with this tag; 0 when there is none.
size_t FindExifEntry(const ExifDirectory& directory, unsigned tag);
// Its first value when it is a SHORT, LONG or RATIONAL; 0 when it is absent or something else.
double ReadExifNumber(const ExifDirectory& directory, unsigned tag);

}  // namespace color3d
