#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "core/splat/import/read_support.h"

namespace color3d {
namespace {

constexpr uint32_t kMagic = 0x5053474e;  // "NGSP"
constexpr size_t kHeaderBytes = 16;
constexpr uint32_t kTableEntryBytes = 16;
constexpr uint32_t kMaxStreams = 64;
constexpr uint64_t kMaxInflation = 1032;  // maximum ratio of deflate

struct Header {
  uint32_t version = 0;
  uint64_t count = 0;
  int degree = 0;
  int fraction_bits = 0;
  size_t turn_bytes() const { return version == 2 ? 3 : 4; }
  // Total size of the streams after the header.
  uint64_t bytes() const {
    return count * (9 + 1 + 3 + 3 + turn_bytes() + 3 * (ShCoefficients(degree) - 1));
  }
};

[[noreturn]] void ThrowShort(const SplatSource& source) {
  throw InvalidArgument("{} is cut short or damaged; copy it again", source.name);
}

// `plain` holds the 16 bytes.
Header ReadHeader(std::string_view plain, bool packed_by_gzip, const SplatSource& source) {
  if (plain.size() < kHeaderBytes) ThrowShort(source);
  if (LittleEndianAt(plain, 0, 4) != kMagic) {
    throw InvalidArgument("{} is not an SPZ; give a .spz, a .sog or a 3DGS .ply", source.name);
  }
  Header header;
  header.version = LittleEndianAt(plain, 4, 4);
  const bool known =
      packed_by_gzip ? header.version == 2 || header.version == 3 : header.version == 4;
  if (!known) {
    throw InvalidArgument(
        "{} is SPZ of version {}; versions 2, 3 and 4 can be read: convert it (splat-transform "
        "in.spz out.ply)",
        source.name,
        header.version);
  }
  header.count = LittleEndianAt(plain, 8, 4);
  header.degree = static_cast<int>(LittleEndianAt(plain, 12, 1));
  header.fraction_bits = static_cast<int>(LittleEndianAt(plain, 13, 1));
  if (header.degree > 3) {
    throw InvalidArgument(
        "{} has harmonics of degree {}; up to 3 can be read", source.name, header.degree);
  }
  if (header.fraction_bits > 23) {
    throw InvalidArgument("{} has positions with {} bits behind the point; they have 24 in all",
                          source.name,
                          header.fraction_bits);
  }
  return header;
}

// Unpacks a gzip file in two steps, the first of which reads the counts.
class Gunzip {
 public:
  explicit Gunzip(std::string_view bytes) {
    inflateInit2(&stream_, 15 + 16);
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream_.avail_in = static_cast<uInt>(std::min<size_t>(bytes.size(), ~0u));
  }
  ~Gunzip() { inflateEnd(&stream_); }
  Gunzip(const Gunzip&) = delete;
  Gunzip& operator=(const Gunzip&) = delete;

  // Returns false if fewer bytes remain.
  bool Append(uint64_t count, std::string* to) {
    const size_t before = to->size();
    to->resize(before + count);
    stream_.next_out = reinterpret_cast<Bytef*>(to->data() + before);
    uint64_t left = count;
    while (left > 0) {
      stream_.avail_out = static_cast<uInt>(std::min<uint64_t>(left, 1u << 30));
      const uInt wanted = stream_.avail_out;
      const int code = inflate(&stream_, Z_NO_FLUSH);
      left -= wanted - stream_.avail_out;
      if (code == Z_STREAM_END) break;
      if (code != Z_OK) return false;
    }
    return left == 0;
  }
  // Returns false if the file ends before its checksum or the checksum differs. Further bytes may
  // follow.
  bool HasValidEnd() {
    Bytef more = 0;
    stream_.next_out = &more;
    stream_.avail_out = 1;
    const int code = inflate(&stream_, Z_NO_FLUSH);
    return code == Z_STREAM_END || (code == Z_OK && stream_.avail_out == 0);
  }

 private:
  z_stream stream_ = {};
};

std::string StreamsOfGzip(std::string_view bytes, const SplatSource& source, Header* header) {
  Gunzip gunzip(bytes);
  std::string plain;
  if (!gunzip.Append(kHeaderBytes, &plain)) ThrowShort(source);
  *header = ReadHeader(plain, /*packed_by_gzip=*/true, source);
  if (header->bytes() > kMaxInflation * bytes.size()) ThrowShort(source);
  CheckCount(header->count, source);
  plain.clear();
  if (!gunzip.Append(header->bytes(), &plain) || !gunzip.HasValidEnd()) ThrowShort(source);
  return plain;
}

std::string StreamsOfZstd(std::string_view bytes, const SplatSource& source, Header* header) {
  *header = ReadHeader(bytes, /*packed_by_gzip=*/false, source);
  if (bytes.size() < kHeaderBytes + 4) ThrowShort(source);
  const uint32_t streams = LittleEndianAt(bytes, 15, 1);
  const uint64_t table = LittleEndianAt(bytes, 16, 4);
  uint64_t at = table + uint64_t{kTableEntryBytes} * streams;
  if (streams > kMaxStreams || at > bytes.size()) ThrowShort(source);
  uint64_t all = 0;
  for (uint32_t i = 0; i < streams; ++i) {
    if (LittleEndianAt(bytes, table + kTableEntryBytes * i + 4, 4) != 0 ||
        LittleEndianAt(bytes, table + kTableEntryBytes * i + 12, 4) != 0) {
      ThrowShort(source);  // 4 GB and more
    }
    all += LittleEndianAt(bytes, table + kTableEntryBytes * i + 8, 4);
  }
  if (all != header->bytes()) {
    throw InvalidArgument("{} claims to have {} Gaussians, but its parts have other sizes",
                          source.name,
                          header->count);
  }
  CheckCount(header->count, source);
  std::string plain(all, '\0');
  size_t to = 0;
  for (uint32_t i = 0; i < streams; ++i) {
    const size_t packed = LittleEndianAt(bytes, table + kTableEntryBytes * i, 4);
    const size_t size = LittleEndianAt(bytes, table + kTableEntryBytes * i + 8, 4);
    if (bytes.size() - at < packed) ThrowShort(source);
    if (ZSTD_decompress(plain.data() + to, size, bytes.data() + at, packed) != size) {
      ThrowShort(source);
    }
    to += size;
    at += packed;
  }
  return plain;
}

// Sign of basis function k after negation of y and z: its parity in them.
float SignOf(int k) {
  static constexpr float kSigns[16] = {1, -1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1};
  return kSigns[k];
}

void ReadRotation(std::string_view plain, size_t at, uint32_t version, float* wxyz) {
  std::array<float, 4> q = {};  // x y z w
  unsigned left_out = 3;
  if (version == 2) {
    for (int k = 0; k < 3; ++k) {
      q[k] = static_cast<float>(LittleEndianAt(plain, at + k, 1)) / 127.5f - 1.0f;
    }
  } else {
    uint32_t packed = LittleEndianAt(plain, at, 4);
    left_out = packed >> 30u;
    for (int k = 3; k >= 0; --k) {
      if (static_cast<unsigned>(k) == left_out) continue;
      const auto size = static_cast<float>(packed & 511u) / 511.0f * std::sqrt(0.5f);
      q[k] = (packed & 512u) != 0 ? -size : size;
      packed >>= 10u;
    }
  }
  float squares = 0.0f;
  for (const float x : q) squares += x * x;
  q[left_out] = std::sqrt(std::max(0.0f, 1.0f - squares));
  const float turned[4] = {q[3], q[0], -q[1], -q[2]};
  std::copy_n(turned, 4, wxyz);
}

}  // namespace

ViewerGaussians ReadSpz(std::string_view bytes, const SplatSource& source) {
  Header header;
  const std::string plain = bytes.starts_with("NGSP") ? StreamsOfZstd(bytes, source, &header)
                                                      : StreamsOfGzip(bytes, source, &header);
  const size_t count = header.count;
  const int coefficients = ShCoefficients(header.degree);
  const size_t turn = header.turn_bytes();
  const size_t opacity = 9 * count, color = opacity + count, scale = color + 3 * count;
  const size_t rotation = scale + 3 * count, harmonics = rotation + turn * count;
  ViewerGaussians g = EmptyGaussians(count, header.degree);
  const auto byte = [&](size_t at) { return static_cast<float>(static_cast<uint8_t>(plain[at])); };
  for (size_t i = 0; i < count; ++i) {
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t bits = LittleEndianAt(plain, 9 * i + 3 * k, 3);
      const auto fixed = static_cast<float>(static_cast<int32_t>(bits << 8u) >> 8);
      g.position[3 * i + k] = std::ldexp(k == 0 ? fixed : -fixed, -header.fraction_bits);
      g.log_scale[3 * i + k] = byte(scale + 3 * i + k) / 16.0f - 10.0f;
      g.sh[i * coefficients * 3 + k] = (byte(color + 3 * i + k) / 255.0f - 0.5f) / 0.15f;
    }
    g.opacity_logit[i] = LogitOf(byte(opacity + i) / 255.0f);
    ReadRotation(plain, rotation + turn * i, header.version, g.rotation.data() + 4 * i);
    for (int k = 1; k < coefficients; ++k) {
      for (int c = 0; c < 3; ++c) {
        const size_t at = harmonics + (i * (coefficients - 1) + k - 1) * 3 + c;
        g.sh[(i * coefficients + k) * 3 + c] = SignOf(k) * (byte(at) - 128.0f) / 128.0f;
      }
    }
  }
  return g;
}

}  // namespace color3d
