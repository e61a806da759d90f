#include "core/image/quick_png.h"

#include <zlib.h>

#include <algorithm>
#include <cstddef>
#include <new>
#include <string_view>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kBandRows = 64;

void AppendNumber(uint32_t number, std::string* to) {
  for (int shift = 24; shift >= 0; shift -= 8) *to += static_cast<char>((number >> shift) & 255u);
}

void AppendChunk(std::string_view type, std::string_view content, std::string* to) {
  AppendNumber(static_cast<uint32_t>(content.size()), to);
  const size_t begin = to->size();
  to->append(type);
  to->append(content);
  const auto* bytes = reinterpret_cast<const Bytef*>(to->data() + begin);
  AppendNumber(static_cast<uint32_t>(crc32_z(0, bytes, to->size() - begin)), to);
}

struct Band {
  std::string deflated;
  uLong adler = 0;
  size_t bytes = 0;  // before
};

// Rows as differences to the pixel on the left: neighbours are alike, which is all that a code of
// bytes without repetitions makes use of.
std::string FilteredRows(const uint8_t* rgb, int width, int rows) {
  const size_t row_bytes = 3 * static_cast<size_t>(width);
  std::string filtered(rows * (row_bytes + 1), '\0');
  auto* out = reinterpret_cast<uint8_t*>(filtered.data());
  for (int row = 0; row < rows; ++row, rgb += row_bytes) {
    *out++ = 1;
    for (size_t i = 0; i < 3; ++i) *out++ = rgb[i];
    for (size_t i = 3; i < row_bytes; ++i) *out++ = static_cast<uint8_t>(rgb[i] - rgb[i - 3]);
  }
  return filtered;
}

Band DeflateBand(const std::string& rows, bool is_last) {
  Band band;
  band.bytes = rows.size();
  auto* bytes = reinterpret_cast<Bytef*>(const_cast<char*>(rows.data()));
  band.adler = adler32_z(1, bytes, rows.size());
  z_stream stream{};
  if (deflateInit2(&stream, 1, Z_DEFLATED, -15, 9, Z_HUFFMAN_ONLY) != Z_OK) throw std::bad_alloc();
  band.deflated.resize(deflateBound(&stream, static_cast<uLong>(rows.size())) + 16);
  stream.next_in = bytes;
  stream.avail_in = static_cast<uInt>(rows.size());
  stream.next_out = reinterpret_cast<Bytef*>(band.deflated.data());
  stream.avail_out = static_cast<uInt>(band.deflated.size());
  const int ended = deflate(&stream, is_last ? Z_FINISH : Z_SYNC_FLUSH);
  const bool is_whole = stream.avail_in == 0 && ended == (is_last ? Z_STREAM_END : Z_OK);
  band.deflated.resize(stream.total_out);
  deflateEnd(&stream);
  if (!is_whole) throw Error(ErrorCode::kInternal, "a picture was not encoded; report this fault");
  return band;
}

}  // namespace

std::string EncodeQuickPng(const std::vector<uint8_t>& rgb,
                           int width,
                           int height,
                           ThreadPool& pool) {
  const size_t row_bytes = 3 * static_cast<size_t>(std::max(width, 0));
  if (width < 1 || height < 1 || rgb.size() != row_bytes * static_cast<size_t>(height)) {
    throw InvalidArgument("cannot encode {} x {} px of {} bytes", width, height, rgb.size());
  }
  std::vector<Band> bands((height + kBandRows - 1) / kBandRows);
  pool.ForEach(static_cast<int64_t>(bands.size()), [&](int64_t k, int) {
    const int first = static_cast<int>(k) * kBandRows;
    const int rows = std::min(kBandRows, height - first);
    const bool is_last = first + rows == height;
    bands[k] = DeflateBand(FilteredRows(rgb.data() + first * row_bytes, width, rows), is_last);
  });
  std::string content("\x78\x01", 2);
  uLong adler = 1;
  for (const Band& band : bands) {
    content += band.deflated;
    adler = adler32_combine(adler, band.adler, static_cast<z_off_t>(band.bytes));
  }
  AppendNumber(static_cast<uint32_t>(adler), &content);

  std::string header;
  AppendNumber(static_cast<uint32_t>(width), &header);
  AppendNumber(static_cast<uint32_t>(height), &header);
  header += std::string("\x08\x02\0\0\0", 5);  // 8 bits, RGB
  std::string png("\x89PNG\r\n\x1a\n", 8);
  png.reserve(content.size() + 128);
  AppendChunk("IHDR", header, &png);
  AppendChunk("sRGB", std::string_view("\x01", 1), &png);
  AppendChunk("IDAT", content, &png);
  AppendChunk("IEND", "", &png);
  return png;
}

}  // namespace color3d
