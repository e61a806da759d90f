#include "core/zip/zip.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string_view>
#include <utility>

#include "core/base/bytes/little_endian.h"
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
constexpr uint16_t kStored = 0, kDeflated = 8;
constexpr uint64_t kMaxDeflateRatio = 1033;
constexpr uint16_t kVersion = 20;        // 2.0: folders and plain files
constexpr uint16_t kFirstDate = 0x0021;  // 1980-01-01
constexpr uint64_t kMaxArchiveBytes = std::numeric_limits<uint32_t>::max();

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
    if (Field<uint16_t>(end, 4) != 0) {
      throw source.Refusal("it is a part of an archive in several files; give it as one file");
    }
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
  ZipRecord record;  // without its offset
};

// Reads the zip64 extra field: those of size, packed size and offset, in this order, whose 32-bit
// fields are all ones.
void ApplyZip64(const ByteSource& source, std::string_view extra, Listed& listed) {
  while (extra.size() >= 4) {
    const uint16_t kind = Field<uint16_t>(extra, 0), length = Field<uint16_t>(extra, 2);
    if (extra.size() - 4 < length) break;
    std::string_view body = extra.substr(4, length);
    extra.remove_prefix(4 + length);
    if (kind != kZip64Extra) continue;
    for (uint64_t* value :
         {&listed.record.size, &listed.record.packed_size, &listed.local_offset}) {
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
  ZipRecord& record = listed.record;
  record.method = Field<uint16_t>(bytes, 10);
  record.checksum = Field<uint32_t>(bytes, 16);
  record.packed_size = Field<uint32_t>(bytes, 20);
  record.size = Field<uint32_t>(bytes, 24);
  listed.local_offset = Field<uint32_t>(bytes, 42);
  if (std::max({record.size, record.packed_size, listed.local_offset}) == 0xffffffff) {
    ApplyZip64(source, bytes.substr(kCentralBytes + name_bytes, extra_bytes), listed);
  }
  if (record.size / kMaxDeflateRatio > record.packed_size ||
      (record.method == kStored && record.size != record.packed_size)) {
    throw source.Refusal("the record {} of {} bytes claims to unpack to {}, which is impossible",
                         QuotedName(listed.name),
                         record.packed_size,
                         record.size);
  }
  return length;
}

// Returns the start of the record's content, checked against its local header.
uint64_t Locate(const ByteSource& source, const Listed& listed) {
  const std::string local = source.ReadString(listed.local_offset, kLocalBytes);
  const uint64_t name_bytes = Field<uint16_t>(local, 26);
  if (Field<uint32_t>(local, 0) != kLocalSignature || name_bytes != listed.name.size() ||
      source.ReadString(listed.local_offset + kLocalBytes, name_bytes) != listed.name) {
    throw source.Refusal("the record {} is not where the zip directory says",
                         QuotedName(listed.name));
  }
  const uint64_t offset =
      listed.local_offset + kLocalBytes + name_bytes + Field<uint16_t>(local, 28);
  if (offset > source.size() || listed.record.packed_size > source.size() - offset) {
    throw source.Refusal("the record {} of {} bytes is not inside the file",
                         QuotedName(listed.name),
                         listed.record.packed_size);
  }
  return offset;
}

// Returns true if the whole of `packed` unpacks to exactly `to.size()` bytes.
bool Inflate(const std::string& packed, std::string& to) {
  z_stream stream = {};
  if (inflateInit2(&stream, -15) != Z_OK) return false;  // without a header
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(to.data());
  stream.avail_out = static_cast<uInt>(to.size());
  const int code = inflate(&stream, Z_FINISH);
  inflateEnd(&stream);
  return code == Z_STREAM_END && stream.total_out == to.size();
}

uint32_t Checksum(const std::string& bytes) {
  return static_cast<uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

void Put16(uint64_t value, std::string* out) { PutLittleEndian(value, 2, out); }
void Put32(uint64_t value, std::string* out) { PutLittleEndian(value, 4, out); }

// Fields common to the local and the central header.
void PutFacts(const ZipEntry& entry, uint32_t checksum, std::string* out) {
  Put16(kVersion, out);
  Put16(0, out);  // flags
  Put16(kStored, out);
  Put16(0, out);  // time
  Put16(kFirstDate, out);
  Put32(checksum, out);
  Put32(entry.bytes.size(), out);  // in the archive
  Put32(entry.bytes.size(), out);
  Put16(entry.name.size(), out);
  Put16(0, out);  // extra field
}

}  // namespace

ZipReader::ZipReader(const ByteSource& source) : source_(source) {
  const Central central = FindCentral(source);
  if (central.count > central.size / kCentralBytes) {
    throw source.Refusal("its zip directory is damaged");
  }
  const std::string bytes = source.ReadString(central.offset, central.size);
  std::string_view rest = bytes;
  std::vector<std::pair<uint64_t, uint64_t>> ranges;  // [begin, end) with the local header
  for (uint64_t i = 0; i < central.count; ++i) {
    Listed listed;
    rest.remove_prefix(ReadListed(source, rest, listed));
    listed.record.offset = Locate(source, listed);
    if (!records_.emplace(listed.name, listed.record).second) {
      throw source.Refusal("the record {} is there twice", QuotedName(listed.name));
    }
    ranges.emplace_back(listed.local_offset, listed.record.offset + listed.record.packed_size);
  }
  ranges.emplace_back(central.offset, central.offset + central.size);
  std::sort(ranges.begin(), ranges.end());
  for (size_t i = 1; i < ranges.size(); ++i) {
    if (ranges[i].first < ranges[i - 1].second) {
      throw source.Refusal("records of its zip directory overlap");
    }
  }
}

const ZipRecord* ZipReader::Find(const std::string& name) const {
  const auto found = records_.find(name);
  return found == records_.end() ? nullptr : &found->second;
}

std::string ZipReader::Read(const std::string& name, uint64_t max_bytes) const {
  const ZipRecord* record = Find(name);
  if (!record) throw source_.Refusal("there is no record {}", QuotedName(name));
  if (record->size > max_bytes) {
    throw source_.Refusal(
        "the record {} has {} bytes, more than {}", QuotedName(name), record->size, max_bytes);
  }
  std::string bytes = source_.ReadString(record->offset, record->packed_size);
  if (record->method == kDeflated) {
    const std::string packed = std::exchange(bytes, std::string(record->size, '\0'));
    if (!Inflate(packed, bytes)) {
      throw source_.Refusal("the record {} is damaged; copy the file again", QuotedName(name));
    }
  } else if (record->method != kStored) {
    throw source_.Refusal("the record {} is compressed by method {}; store it uncompressed",
                          QuotedName(name),
                          record->method);
  }
  if (Checksum(bytes) != record->checksum) {
    throw source_.Refusal("the record {} does not have its checksum; copy the file again",
                          QuotedName(name));
  }
  return bytes;
}

std::string StoredZip(const std::vector<ZipEntry>& entries) {
  std::string out, directory;
  for (const ZipEntry& entry : entries) {
    if (out.size() + entry.bytes.size() >= kMaxArchiveBytes) {
      throw InvalidArgument("{} makes the archive larger than the 4 GB of a zip", entry.name);
    }
    const size_t offset = out.size();
    const uint32_t checksum = Checksum(entry.bytes);
    Put32(kLocalSignature, &out);
    PutFacts(entry, checksum, &out);
    out += entry.name + entry.bytes;

    Put32(kCentralSignature, &directory);
    Put16(kVersion, &directory);  // made by
    PutFacts(entry, checksum, &directory);
    Put16(0, &directory);  // comment
    Put16(0, &directory);  // disk
    Put16(0, &directory);  // internal attributes
    Put32(0, &directory);  // external attributes
    Put32(offset, &directory);
    directory += entry.name;
  }
  const size_t begin = out.size();
  out += directory;
  Put32(kEndSignature, &out);
  Put16(0, &out);  // this disk
  Put16(0, &out);  // disk of the directory
  Put16(entries.size(), &out);
  Put16(entries.size(), &out);
  Put32(directory.size(), &out);
  Put32(begin, &out);
  Put16(0, &out);  // comment
  return out;
}

}  // namespace color3d
