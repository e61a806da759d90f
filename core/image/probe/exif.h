// Location of EXIF data in a picture, and its entries. For this folder only. Pure functions on the
// caller's bytes, safe on hostile input.
#pragma once

#include <cstddef>
#include <string_view>

namespace color3d {

// The EXIF block in TIFF form: a JPEG's APP1, a PNG's eXIf, a WebP's EXIF chunk, a HEIC's Exif
// item, or the TIFF file itself. Empty if there is none.
std::string_view FindExifBlock(std::string_view bytes);

// Location of one directory in a block.
struct ExifDirectory {
  std::string_view block;
  size_t at = 0;
  bool big_endian = true;
};

// Returns false if the block is not TIFF.
bool FirstExifDirectory(std::string_view block, ExifDirectory* directory);
// Returns false if the directory has no entry `tag` that refers to another one.
bool FurtherExifDirectory(const ExifDirectory& from, unsigned tag, ExifDirectory* directory);
// Returns false if the first directory has no reference to the EXIF directory (tag 34665).
bool PhotoExifDirectory(const ExifDirectory& first, ExifDirectory* directory);

// Offset in the block of the 12-byte entry with this tag; 0 if there is none.
size_t FindExifEntry(const ExifDirectory& directory, unsigned tag);
// The first value if it is a SHORT, LONG or RATIONAL; else 0.
double ReadExifNumber(const ExifDirectory& directory, unsigned tag);

}  // namespace color3d
