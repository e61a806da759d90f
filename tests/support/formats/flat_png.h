// PNGs of any size whose files are small.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <string>

namespace color3d {

// A PNG of constant value, grey or RGB (3 channels): some hundred kilobytes at any size.
inline std::string FlatPng(int width, int height, int channels, char value) {
  const auto number = [](uint32_t v) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(v >> shift);
    return bytes;
  };
  const auto chunk = [&](const std::string& type, const std::string& data) {
    const std::string body = type + data;
    const auto crc = crc32_z(0, reinterpret_cast<const Bytef*>(body.data()), body.size());
    return number(static_cast<uint32_t>(data.size())) + body + number(static_cast<uint32_t>(crc));
  };
  std::string row(static_cast<size_t>(width) * channels + 1, value);
  row[0] = 0;  // no filter
  z_stream stream = {};
  deflateInit(&stream, 1);
  std::string packed(1 << 16, '\0'), data;
  for (int y = 0; y < height; ++y) {
    stream.next_in = reinterpret_cast<Bytef*>(row.data());
    stream.avail_in = static_cast<uInt>(row.size());
    const int flush = y + 1 == height ? Z_FINISH : Z_NO_FLUSH;
    do {
      stream.next_out = reinterpret_cast<Bytef*>(packed.data());
      stream.avail_out = static_cast<uInt>(packed.size());
      deflate(&stream, flush);
      data.append(packed, 0, packed.size() - stream.avail_out);
    } while (stream.avail_out == 0);
  }
  deflateEnd(&stream);
  const std::string color(1, channels == 3 ? '\2' : '\0');
  const std::string header = number(static_cast<uint32_t>(width)) +
                             number(static_cast<uint32_t>(height)) + '\x08' + color +
                             std::string(3, '\0');
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", header) + chunk("IDAT", data) + chunk("IEND", "");
}

}  // namespace color3d
