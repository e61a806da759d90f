#include "core/weights/zip_archive.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/files.h"

// Field offsets as in the .ZIP File Format Specification (APPNOTE.TXT 6.3.10), 4.3.
namespace color3d {
namespace {

constexpr uint32_t kLocalSignature = 0x04034b50;
constexpr uint32_t kCentralSignature = 0x02014b50;
constexpr uint32_t kEndSignature = 0x06054b50;
constexpr uint32_t kEnd64Signature = 0x06064b50;
constexpr uint32_t kLocator64Signature = 0x07064b50;
constexpr uint64_t kLocalBytes = 30;
constexpr uint64_t kCentralBytes = 46;
constexpr uint64_t kEndBytes = 22;
constexpr uint64_t kEnd64Bytes = 56;
constexpr uint64_t kLocator64Bytes = 20;
constexpr uint64_t kLongestComment = 65535;
constexpr uint16_t kZip64Extra = 1;

template <typename Number>
Number Field(std::string_view bytes, uint64_t offset) {
  Number value;
  std::memcpy(&value, bytes.data() + offset, sizeof(value));
  return value;
}

// Location of the list of records.
struct Central {
  uint64_t offset = 0;
  uint64_t size = 0;
  uint64_t count = 0;
};

Central ReadEnd64(const ByteSource& source, uint64_t end_offset) {
  if (end_offset < kLocator64Bytes) throw source.Refusal("its zip64 directory is missing");
  const std::string locator = source.ReadString(end_offset - kLocator64Bytes, kLocator64Bytes);
  if (Field<uint32_t>(locator, 0) != kLocator64Signature) {
    throw source.Refusal("its zip64 directory is missing");
  }
  const std::string end = source.ReadString(Field<uint64_t>(locator, 8), kEnd64Bytes);
  if (Field<uint32_t>(end, 0) != kEnd64Signature) {
    throw source.Refusal("its zip64 directory is damaged");
  }
  return {Field<uint64_t>(end, 48), Field<uint64_t>(end, 40), Field<uint64_t>(end, 32)};
}

Central FindCentral(const ByteSource& source) {
  const uint64_t tail_bytes = std::min(source.size(), kEndBytes + kLongestComment);
  const uint64_t tail_offset = source.size() - tail_bytes;
  const std::string tail = source.ReadString(tail_offset, tail_bytes);
  for (uint64_t back = kEndBytes; back <= tail_bytes; ++back) {
    const std::string_view end = std::string_view(tail).substr(tail_bytes - back);
    if (Field<uint32_t>(end, 0) != kEndSignature) continue;
    if (Field<uint16_t>(end, 20) != back - kEndBytes) continue;  // coincidence in a comment
    const Central central{
        Field<uint32_t>(end, 16), Field<uint32_t>(end, 12), Field<uint16_t>(end, 10)};
    const bool is_zip64 =
        central.offset == 0xffffffff || central.size == 0xffffffff || central.count == 0xffff;
    return is_zip64 ? ReadEnd64(source, source.size() - back) : central;
  }
  throw source.Refusal("its zip directory is missing; the file is cut short or damaged");
}

// Entry of a record in the directory.
struct Listed {
  std::string name;
  uint64_t local_offset = 0;
  uint64_t size = 0;  // in the file
  bool compressed = false;
};

// Reads the zip64 extra field: those of size, stored size and offset, in this order, whose 32-bit
// fields are all ones.
void ApplyZip64(const ByteSource& source,
                std::string_view extra,
                uint64_t& size,
                uint64_t& stored_size,
                uint64_t& offset) {
  while (extra.size() >= 4) {
    const uint16_t kind = Field<uint16_t>(extra, 0), length = Field<uint16_t>(extra, 2);
    if (extra.size() - 4 < length) break;
    std::string_view body = extra.substr(4, length);
    extra.remove_prefix(4 + length);
    if (kind != kZip64Extra) continue;
    for (uint64_t* value : {&size, &stored_size, &offset}) {
      if (*value != 0xffffffff) continue;
      if (body.size() < 8) throw source.Refusal("its zip64 fields are damaged");
      *value = Field<uint64_t>(body, 0);
      body.remove_prefix(8);
    }
    return;
  }
  throw source.Refusal("its zip64 fields are missing");
}

// Reads the entry at `bytes`. Returns its length in the directory.
uint64_t ReadListed(const ByteSource& source, std::string_view bytes, Listed& listed) {
  if (bytes.size() < kCentralBytes || Field<uint32_t>(bytes, 0) != kCentralSignature) {
    throw source.Refusal("its zip directory is damaged");
  }
  const uint64_t name_bytes = Field<uint16_t>(bytes, 28), extra_bytes = Field<uint16_t>(bytes, 30);
  const uint64_t length = kCentralBytes + name_bytes + extra_bytes + Field<uint16_t>(bytes, 32);
  if (bytes.size() < length) throw source.Refusal("its zip directory is damaged");
  listed.name = bytes.substr(kCentralBytes, name_bytes);
  // Records of folders end in '/'.
  if (!IsSafeRelativePath(listed.name.substr(0, listed.name.find_last_not_of('/') + 1))) {
    throw source.Refusal("the record name {} is not a plain relative path",
                         QuotedName(listed.name));
  }
  if (Field<uint16_t>(bytes, 8) & 1) {
    throw source.Refusal("the record {} is encrypted", QuotedName(listed.name));
  }
  uint64_t size = Field<uint32_t>(bytes, 24), stored_size = Field<uint32_t>(bytes, 20);
  listed.local_offset = Field<uint32_t>(bytes, 42);
  if (std::max({size, stored_size, listed.local_offset}) == 0xffffffff) {
    ApplyZip64(source,
               bytes.substr(kCentralBytes + name_bytes, extra_bytes),
               size,
               stored_size,
               listed.local_offset);
  }
  listed.compressed = Field<uint16_t>(bytes, 10) != 0;
  if (!listed.compressed && stored_size != size) {
    throw source.Refusal("the record {} has two sizes", QuotedName(listed.name));
  }
  listed.size = stored_size;
  return length;
}

// Returns the start of the record's content, checked against its local header.
ZipRecord Locate(const ByteSource& source, const Listed& listed) {
  const std::string local = source.ReadString(listed.local_offset, kLocalBytes);
  const uint64_t name_bytes = Field<uint16_t>(local, 26);
  if (Field<uint32_t>(local, 0) != kLocalSignature || name_bytes != listed.name.size() ||
      source.ReadString(listed.local_offset + kLocalBytes, name_bytes) != listed.name) {
    throw source.Refusal("the record {} is not where the zip directory says",
                         QuotedName(listed.name));
  }
  const uint64_t offset =
      listed.local_offset + kLocalBytes + name_bytes + Field<uint16_t>(local, 28);
  if (offset > source.size() || listed.size > source.size() - offset) {
    throw source.Refusal(
        "the record {} of {} bytes is not inside the file", QuotedName(listed.name), listed.size);
  }
  return {offset, listed.size, listed.compressed};
}

}  // namespace

ZipDirectory ReadZipDirectory(const ByteSource& source) {
  const Central central = FindCentral(source);
  if (central.count > central.size / kCentralBytes) {
    throw source.Refusal("its zip directory is damaged");
  }
  const std::string bytes = source.ReadString(central.offset, central.size);
  std::string_view rest = bytes;
  ZipDirectory directory;
  std::vector<std::pair<uint64_t, uint64_t>> ranges;  // [begin, end) with the local header
  for (uint64_t i = 0; i < central.count; ++i) {
    Listed listed;
    rest.remove_prefix(ReadListed(source, rest, listed));
    const ZipRecord record = Locate(source, listed);
    if (!directory.emplace(listed.name, record).second) {
      throw source.Refusal("the record {} is there twice", QuotedName(listed.name));
    }
    ranges.emplace_back(listed.local_offset, record.offset + record.size);
  }
  ranges.emplace_back(central.offset, central.offset + central.size);
  std::sort(ranges.begin(), ranges.end());
  for (size_t i = 1; i < ranges.size(); ++i) {
    if (ranges[i].first < ranges[i - 1].second) {
      throw source.Refusal("records of its zip directory overlap");
    }
  }
  return directory;
}

const ZipRecord* FindStored(const ZipDirectory& directory,
                            const std::string& name,
                            const ByteSource& source) {
  const auto found = directory.find(name);
  if (found == directory.end()) return nullptr;
  if (found->second.compressed) {
    throw source.Refusal(
        "the record {} is compressed, which PyTorch never does; pack the archive again with stored "
        "records (zip -0)",
        QuotedName(name));
  }
  return &found->second;
}

}  // namespace color3d
