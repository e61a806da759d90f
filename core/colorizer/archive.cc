#include "core/colorizer/archive.h"

#include <bit>
#include <cstring>
#include <utility>

#include "core/base/digest.h"
#include "core/base/error.h"

namespace color3d {
namespace {

static_assert(std::endian::native == std::endian::little, "archives are written as they lie");

constexpr size_t kDigestHexLength = 64;
constexpr int kMaxRank = 8;

template <typename T>
void Append(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

class Cursor {
 public:
  Cursor(std::string_view bytes, const std::string& what) : bytes_(bytes), what_(what) {}

  template <typename T>
  T Take() {
    T value;
    const std::string_view raw = TakeBytes(sizeof(T));
    std::memcpy(&value, raw.data(), sizeof(T));
    return value;
  }
  std::string_view TakeBytes(uint64_t count) {
    if (count > bytes_.size()) throw InvalidArgument(what_ + " is cut short; upload it again");
    const std::string_view taken = bytes_.substr(0, count);
    bytes_.remove_prefix(count);
    return taken;
  }
  bool AtEnd() const { return bytes_.empty(); }

 private:
  std::string_view bytes_;
  const std::string& what_;
};

ArchiveArray ReadArray(Cursor& cursor, const std::string& what) {
  ArchiveArray array;
  const uint8_t type = cursor.Take<uint8_t>();
  const uint8_t rank = cursor.Take<uint8_t>();
  if (type > 1 || rank > kMaxRank) {
    throw InvalidArgument(what + " holds an array of unknown type " + std::to_string(type) +
                          " and rank " + std::to_string(rank));
  }
  array.type = static_cast<ArchiveArray::Type>(type);
  uint64_t size = array.type == ArchiveArray::Type::kFloat32 ? 4 : 2;
  for (int i = 0; i < rank; ++i) {
    const int64_t extent = cursor.Take<int64_t>();
    // Each extent is bounded before the product, so that the product cannot overflow.
    if (extent < 0 || extent > (int64_t{1} << 28) || (size *= extent) > (uint64_t{1} << 32)) {
      throw InvalidArgument(what + " holds an array with the impossible extent " +
                            std::to_string(extent));
    }
    array.shape.push_back(extent);
  }
  array.bytes = std::string(cursor.TakeBytes(size));
  return array;
}

}  // namespace

std::string WriteArchive(const Archive& archive, std::string_view magic) {
  std::string out(magic);
  Append<uint32_t>(out, archive.version);
  Append<uint32_t>(out, static_cast<uint32_t>(archive.header.size()));
  out += archive.header;
  Append<uint32_t>(out, static_cast<uint32_t>(archive.arrays.size()));
  for (const auto& [name, array] : archive.arrays) {
    Append<uint32_t>(out, static_cast<uint32_t>(name.size()));
    out += name;
    Append<uint8_t>(out, static_cast<uint8_t>(array.type));
    Append<uint8_t>(out, static_cast<uint8_t>(array.shape.size()));
    for (int64_t extent : array.shape) Append<int64_t>(out, extent);
    out += array.bytes;
  }
  return out + Sha256Hex(out);
}

Archive ReadArchive(std::string_view bytes,
                    std::string_view magic,
                    uint32_t version,
                    const std::string& what) {
  if (bytes.substr(0, magic.size()) != magic) {
    throw InvalidArgument(what + " does not start with \"" + std::string(magic) +
                          "\": it is a file of another kind");
  }
  if (bytes.size() < magic.size() + kDigestHexLength) {
    throw InvalidArgument(what + " is cut short; upload it again");
  }
  const std::string_view body = bytes.substr(0, bytes.size() - kDigestHexLength);
  if (Sha256Hex(body) != bytes.substr(body.size())) {
    throw InvalidArgument(what + " is damaged or cut short (its checksum does not match)");
  }
  Cursor cursor(body.substr(magic.size()), what);
  Archive archive;
  archive.version = cursor.Take<uint32_t>();
  if (archive.version != version) {
    throw InvalidArgument(what + " has version " + std::to_string(archive.version) +
                          ", this program reads version " + std::to_string(version));
  }
  archive.header = std::string(cursor.TakeBytes(cursor.Take<uint32_t>()));
  const uint32_t count = cursor.Take<uint32_t>();
  for (uint32_t i = 0; i < count; ++i) {
    std::string name(cursor.TakeBytes(cursor.Take<uint32_t>()));
    archive.arrays[std::move(name)] = ReadArray(cursor, what);
  }
  if (!cursor.AtEnd()) throw InvalidArgument(what + " has bytes after its end");
  return archive;
}

}  // namespace color3d
