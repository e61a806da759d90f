// The pages of a TIFF file, which may contain previews before, after or below the picture. Plain
// C++, no codec. Pure functions on the caller's bytes, safe on hostile input.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace color3d {

struct TiffPage {
  size_t directory = 0;  // offset in the file, bytes
  int64_t width = 0;     // px
  int64_t height = 0;
  bool is_reduced = false;  // marked as a reduced copy (NewSubfileType)
};

struct TiffPages {
  std::vector<TiffPage> pages;  // of the chain and of SubIFDs, at most 1,000, without masks
  size_t chosen = 0;            // the largest; of equal ones the first that is not a reduced copy
};

// Empty if the bytes do not start as TIFF. An unreadable directory ends the list.
TiffPages ListTiffPages(std::string_view bytes);

// The selected page's directory; the first one if no page can be read. 0: not a TIFF.
size_t ChosenTiffDirectory(std::string_view bytes);

// A note for the user on a file with several pages: "has 2 pages; ..."; empty for one page.
std::string DescribeTiffPages(const TiffPages& pages);

// A copy of a TIFF that begins with the page at `directory` and has orientation 1, if any: codecs
// read the first page, and differ in how they apply orientation.
std::string TiffPageAsStored(std::string_view bytes, size_t directory);

}  // namespace color3d
