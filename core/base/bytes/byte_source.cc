#include "core/base/bytes/byte_source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace color3d {

void ByteSource::ReadAt(uint64_t offset, uint64_t count, void* out) const {
  if (offset > size_ || count > size_ - offset) {
    throw Refusal("cut short: needs {} bytes at {}, but the file has {}", count, offset, size_);
  }
  if (count > 0) DoRead(offset, count, static_cast<char*>(out));
}

std::string ByteSource::ReadString(uint64_t offset, uint64_t count) const {
  // Checked before allocation, since `count` may come from a hostile file.
  if (offset > size_ || count > size_ - offset) ReadAt(offset, count, nullptr);
  std::string bytes(count, '\0');
  ReadAt(offset, count, bytes.data());
  return bytes;
}

Error ByteSource::Refusal(const std::string& reason) const {
  return InvalidArgument("{}: {}", name_, reason);
}

MemorySource::MemorySource(std::string_view bytes, const std::string& name)
    : ByteSource(name, bytes.size()), bytes_(bytes) {}

void MemorySource::DoRead(uint64_t offset, uint64_t count, char* out) const {
  std::memcpy(out, bytes_.data() + offset, count);
}

FileSource::Opened FileSource::Open(const std::filesystem::path& path) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) {
    throw Error(errno == ENOENT ? ErrorCode::kNotFound : ErrorCode::kFailedPrecondition,
                "cannot open {}: {}",
                path.string(),
                std::strerror(errno));
  }
  struct stat status {};
  if (fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
    close(descriptor);
    throw Error(ErrorCode::kNotFound, "{} is not a regular file", path.string());
  }
  return {descriptor, static_cast<uint64_t>(status.st_size)};
}

FileSource::FileSource(const std::filesystem::path& path) : FileSource(path, Open(path)) {}

FileSource::FileSource(const std::filesystem::path& path, const Opened& opened)
    : ByteSource(path.filename().string(), opened.size), descriptor_(opened.descriptor) {}

FileSource::~FileSource() { close(descriptor_); }

void FileSource::DoRead(uint64_t offset, uint64_t count, char* out) const {
  while (count > 0) {
    const ssize_t got = pread(descriptor_, out, count, static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) {
      throw Error(ErrorCode::kDataLoss,
                  "{}: {}",
                  name(),
                  got < 0 ? std::strerror(errno) : "the file became shorter while it was read");
    }
    out += got;
    offset += static_cast<uint64_t>(got);
    count -= static_cast<uint64_t>(got);
  }
}

std::string QuotedName(std::string_view name) {
  constexpr size_t kLongest = 100;
  std::string text = "\"";
  for (char c : name.substr(0, kLongest)) text += c >= ' ' && c <= '~' ? c : '?';
  return text + (name.size() > kLongest ? "...\"" : "\"");
}

}  // namespace color3d
