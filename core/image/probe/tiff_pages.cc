#include "core/image/probe/tiff_pages.h"

#include <fmt/core.h>

#include <algorithm>
#include <set>

#include "core/image/probe/byte_reader.h"
#include "core/image/probe/exif.h"
#include "core/image/probe/probe_formats.h"

namespace color3d {
namespace {

constexpr size_t kMaxPages = 1000;
// TIFF 6.0 tags, and SubIFDs of its first supplement.
constexpr unsigned kNewSubfileType = 254, kWidth = 256, kHeight = 257, kOrientation = 274;
constexpr unsigned kSubDirectories = 330;
constexpr unsigned kReducedFlag = 1, kMaskFlag = 4;

void PutInteger(std::string* bytes, size_t at, uint32_t value, size_t count, bool big_endian) {
  for (size_t i = 0; i < count; ++i) {
    const size_t shift = 8 * (big_endian ? count - 1 - i : i);
    (*bytes)[at + i] = static_cast<char>(value >> shift & 255u);
  }
}

class PageWalk {
 public:
  PageWalk(std::string_view bytes, bool big_endian)
      : bytes_(bytes), reader_(bytes, big_endian), big_endian_(big_endian) {}

  void FollowChain(size_t at) {
    while (at != 0 && seen_.size() < kMaxPages && seen_.insert(at).second) {
      if (!reader_.Has(at, 2)) return;
      const size_t behind = at + 2 + size_t{12} * reader_.U16(at);
      if (!reader_.Has(at, behind - at)) return;
      AddPage(at);
      AddSubDirectories(at);
      at = reader_.U32(behind);
    }
  }

  TiffPages pages;

 private:
  ExifDirectory DirectoryAt(size_t at) const { return {bytes_, at, big_endian_}; }

  void AddPage(size_t at) {
    const ExifDirectory directory = DirectoryAt(at);
    const auto kind = static_cast<unsigned>(ReadExifNumber(directory, kNewSubfileType));
    const double width = ReadExifNumber(directory, kWidth);
    const double height = ReadExifNumber(directory, kHeight);
    if (width < 1.0 || height < 1.0 || (kind & kMaskFlag) != 0) return;
    pages.pages.push_back({at,
                           static_cast<int64_t>(width),
                           static_cast<int64_t>(height),
                           (kind & kReducedFlag) != 0});
  }

  void AddSubDirectories(size_t at) {
    const size_t entry = FindExifEntry(DirectoryAt(at), kSubDirectories);
    if (entry == 0) return;
    const size_t count = reader_.U32(entry + 4);
    const size_t values = count == 1 ? entry + 8 : reader_.U32(entry + 8);
    for (size_t i = 0; i < std::min(count, kMaxPages) && seen_.size() < kMaxPages; ++i) {
      if (!reader_.Has(values + 4 * i, 4)) return;
      const size_t sub = reader_.U32(values + 4 * i);
      if (reader_.Has(sub, 2) && seen_.insert(sub).second) AddPage(sub);
    }
  }

  const std::string_view bytes_;
  const ByteReader reader_;
  const bool big_endian_;
  std::set<size_t> seen_;
};

}  // namespace

TiffPages ListTiffPages(std::string_view bytes) {
  probe_internal::TiffHeader header;
  if (!probe_internal::ReadTiffHeader(bytes, &header)) return {};
  PageWalk walk(bytes, header.big_endian);
  walk.FollowChain(header.first_directory);
  TiffPages& found = walk.pages;
  const auto area = [](const TiffPage& page) {
    return static_cast<double>(page.width) * static_cast<double>(page.height);
  };
  for (size_t i = 1; i < found.pages.size(); ++i) {
    const TiffPage& page = found.pages[i];
    const TiffPage& best = found.pages[found.chosen];
    const bool larger = area(page) > area(best);
    const bool no_copy = area(page) == area(best) && best.is_reduced && !page.is_reduced;
    if (larger || no_copy) found.chosen = i;
  }
  return found;
}

size_t ChosenTiffDirectory(std::string_view bytes) {
  const TiffPages pages = ListTiffPages(bytes);
  if (!pages.pages.empty()) return pages.pages[pages.chosen].directory;
  probe_internal::TiffHeader header;
  return probe_internal::ReadTiffHeader(bytes, &header) ? header.first_directory : 0;
}

std::string DescribeTiffPages(const TiffPages& pages) {
  const std::vector<TiffPage>& all = pages.pages;
  if (all.size() < 2) return "";
  const TiffPage& chosen = all[pages.chosen];
  const bool equal = std::all_of(all.begin(), all.end(), [&](const TiffPage& page) {
    return page.width == chosen.width && page.height == chosen.height;
  });
  if (equal) {
    return fmt::format("has {} pages of {} x {} px; the first is read, save the others as files",
                       all.size(),
                       chosen.width,
                       chosen.height);
  }
  return fmt::format(
      "has {} pages; the largest is read ({} x {} px)", all.size(), chosen.width, chosen.height);
}

std::string TiffPageAsStored(std::string_view bytes, size_t directory) {
  std::string copy(bytes);
  probe_internal::TiffHeader header;
  if (!probe_internal::ReadTiffHeader(bytes, &header)) return copy;
  const bool big_endian = header.big_endian;
  const size_t entry = FindExifEntry({bytes, directory, big_endian}, kOrientation);
  if (entry != 0) {
    const bool is_long = ByteReader(bytes, big_endian).U16(entry + 2) == 4;
    PutInteger(&copy, entry + 8, 0, 4, big_endian);
    PutInteger(&copy, entry + 8, 1, is_long ? 4 : 2, big_endian);
  }
  PutInteger(&copy, 4, static_cast<uint32_t>(directory), 4, big_endian);
  return copy;
}

}  // namespace color3d
