#include "core/splat/import/unzip.h"

#include <zlib.h>

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/splat/import/read_support.h"

namespace color3d {
namespace {

constexpr uint32_t kLocalSignature = 0x04034b50;
constexpr uint32_t kCentralSignature = 0x02014b50;
constexpr uint32_t kEndSignature = 0x06054b50;
constexpr size_t kLocalBytes = 30, kCentralBytes = 46, kEndBytes = 22;
constexpr size_t kMaxCommentBytes = 65'535;
constexpr uint32_t kStored = 0, kDeflated = 8;
constexpr uint32_t kZip64 = 0xffffffff;
constexpr uint32_t kMostDeflated = 1033;  // bytes that one can stand for, at most

// Returns true if the whole of `packed` unpacks to exactly `to->size()` bytes.
bool Inflate(std::string_view packed, std::string* to) {
  z_stream stream = {};
  if (inflateInit2(&stream, -15) != Z_OK) return false;  // without a header
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(to->data());
  stream.avail_out = static_cast<uInt>(to->size());
  const int code = inflate(&stream, Z_FINISH);
  inflateEnd(&stream);
  return code == Z_STREAM_END && stream.total_out == to->size();
}

}  // namespace

ZipReader::ZipReader(std::string_view bytes, std::string name)
    : bytes_(bytes), name_(std::move(name)) {
  const size_t reach = std::min(bytes.size(), kEndBytes + kMaxCommentBytes);
  for (size_t back = kEndBytes; back <= reach; ++back) {
    const size_t at = bytes.size() - back;
    if (LittleEndianAt(bytes, at, 4) != kEndSignature) continue;
    if (LittleEndianAt(bytes, at + 20, 2) + kEndBytes != back) continue;  // inside of a comment
    if (LittleEndianAt(bytes, at + 4, 2) != 0) {
      throw InvalidArgument("{} is a part of a zip of several files; give it as one", name_);
    }
    ReadDirectory(LittleEndianAt(bytes, at + 16, 4), LittleEndianAt(bytes, at + 10, 2), at);
    return;
  }
  throw InvalidArgument("{} has no end of a zip; it was cut short: copy it again", name_);
}

void ZipReader::ReadDirectory(size_t at, uint32_t count, size_t end) {
  for (uint32_t i = 0; i < count; ++i) {
    if (at + kCentralBytes > end || LittleEndianAt(bytes_, at, 4) != kCentralSignature) {
      throw InvalidArgument("the directory of {} is damaged; copy it again", name_);
    }
    Entry entry;
    const uint32_t flags = LittleEndianAt(bytes_, at + 8, 2);
    entry.method = LittleEndianAt(bytes_, at + 10, 2);
    entry.crc = LittleEndianAt(bytes_, at + 16, 4);
    entry.packed_bytes = LittleEndianAt(bytes_, at + 20, 4);
    entry.bytes = LittleEndianAt(bytes_, at + 24, 4);
    entry.offset = LittleEndianAt(bytes_, at + 42, 4);
    const size_t name_bytes = LittleEndianAt(bytes_, at + 28, 2);
    const size_t more =
        name_bytes + LittleEndianAt(bytes_, at + 30, 2) + LittleEndianAt(bytes_, at + 32, 2);
    if (at + kCentralBytes + more > end) {
      throw InvalidArgument("the directory of {} is damaged; copy it again", name_);
    }
    const std::string file(bytes_.substr(at + kCentralBytes, name_bytes));
    // A folder's own entry ends in '/'.
    if (!IsSafeRelativePath(file.substr(0, file.find_last_not_of('/') + 1))) {
      throw InvalidArgument("{} holds a file whose name is not a plain relative path", name_);
    }
    if ((flags & 1u) != 0) throw InvalidArgument("{} of {} is encrypted", file, name_);
    if (entry.bytes == kZip64 || entry.packed_bytes == kZip64 || entry.offset == kZip64) {
      throw InvalidArgument("{} is a zip64; archives of up to 4 GB can be read", name_);
    }
    if (entry.bytes / kMostDeflated > entry.packed_bytes) {
      throw InvalidArgument("{} of {} says that {} bytes unpack to {}, which is impossible",
                            file,
                            name_,
                            entry.packed_bytes,
                            entry.bytes);
    }
    if (!entries_.emplace(file, entry).second) {
      throw InvalidArgument("{} is twice in {}", file, name_);
    }
    at += kCentralBytes + more;
  }
}

std::string ZipReader::Read(const std::string& file, uint64_t max_bytes) const {
  const auto found = entries_.find(file);
  if (found == entries_.end() && !IsSafeRelativePath(file)) {
    throw InvalidArgument("{} names a file by what is not a plain relative path", name_);
  }
  if (found == entries_.end()) throw InvalidArgument("{} holds no {}", name_, file);
  const Entry& entry = found->second;
  if (entry.bytes > max_bytes) {
    throw InvalidArgument("{} of {} says that it has {} bytes; at most {} make sense there",
                          file,
                          name_,
                          entry.bytes,
                          max_bytes);
  }
  const size_t local = entry.offset;
  if (local + kLocalBytes > bytes_.size() || LittleEndianAt(bytes_, local, 4) != kLocalSignature) {
    throw InvalidArgument("{} of {} is damaged; copy it again", file, name_);
  }
  const size_t name_bytes = LittleEndianAt(bytes_, local + 26, 2);
  if (bytes_.substr(local + kLocalBytes, name_bytes) != file) {
    throw InvalidArgument("{} is not where the directory of {} says; copy it again", file, name_);
  }
  const size_t begin = local + kLocalBytes + name_bytes + LittleEndianAt(bytes_, local + 28, 2);
  if (begin > bytes_.size() || bytes_.size() - begin < entry.packed_bytes) {
    throw InvalidArgument("{} of {} is cut short; copy it again", file, name_);
  }
  const std::string_view packed = bytes_.substr(begin, entry.packed_bytes);
  std::string content;
  if (entry.method == kStored && entry.packed_bytes == entry.bytes) {
    content = packed;
  } else if (entry.method == kDeflated) {
    content.resize(entry.bytes);
    if (!Inflate(packed, &content)) {
      throw InvalidArgument("{} of {} is damaged; copy it again", file, name_);
    }
  } else {
    throw InvalidArgument(
        "{} of {} is compressed by a method (number {}) that cannot be read; store it plainly",
        file,
        name_,
        entry.method);
  }
  const auto crc = static_cast<uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(content.data()), content.size()));
  if (crc != entry.crc) {
    throw InvalidArgument("{} of {} has another checksum than it says; copy it again", file, name_);
  }
  return content;
}

}  // namespace color3d
