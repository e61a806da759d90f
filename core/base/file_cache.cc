#include "core/base/file_cache.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <system_error>
#include <vector>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr size_t kDigestLength = 64;
constexpr int64_t kMaxEntryBytes = int64_t{1} << 30;
// A cache must not fill the disk that results are written to.
constexpr uintmax_t kReserveBytes = uintmax_t{512} << 20;
constexpr char kTemporary[] = ".put-";
constexpr auto kTemporaryAge = std::chrono::hours(1);

// Covers the key, too: an entry under another key's name is invalid.
std::string Seal(const std::string& key, std::string_view bytes) {
  Sha256 hash;
  hash.Update(key);
  hash.Update(bytes);
  return hash.FinishHex();
}

bool WriteWhole(const fs::path& path, const std::string& seal, std::string_view bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(seal.data(), static_cast<std::streamsize>(seal.size()));
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  return file.good();
}

struct Entry {
  fs::path path;
  fs::file_time_type used;
  int64_t bytes = 0;
};

// Lists entries and removes temporary files of crashed writers.
std::vector<Entry> ListEntries(const fs::path& folder) {
  std::vector<Entry> entries;
  std::error_code error;
  const auto now = fs::file_time_type::clock::now();
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::error_code ignored;
    Entry entry{it->path(), it->last_write_time(ignored), 0};
    if (ignored) continue;
    entry.bytes = static_cast<int64_t>(it->file_size(ignored));
    if (ignored) continue;
    if (!entry.path.filename().string().starts_with(kTemporary)) {
      entries.push_back(std::move(entry));
    } else if (now - entry.used > kTemporaryAge) {
      fs::remove(entry.path, ignored);
    }
  }
  return entries;
}

}  // namespace

std::optional<std::string> FileCache::Get(const std::string& key) const {
  std::error_code error;
  if (folder_.empty() || !IsSha256Hex(key)) return std::nullopt;
  const fs::path path = folder_ / key;
  if (!fs::is_regular_file(path, error)) return std::nullopt;
  std::string bytes;
  try {
    bytes = ReadFile(path, kMaxEntryBytes);
  } catch (const Error&) {  // trimmed by another process in between, or unreadable
    return std::nullopt;
  }
  const std::string seal = bytes.substr(0, kDigestLength);
  bytes.erase(0, kDigestLength);
  if (seal != Seal(key, bytes)) {
    fs::remove(path, error);
    return std::nullopt;
  }
  fs::last_write_time(path, fs::file_time_type::clock::now(), error);
  return bytes;
}

void FileCache::Put(const std::string& key, std::string_view bytes) const {
  if (folder_.empty() || !IsSha256Hex(key)) return;
  static std::atomic<uint64_t> counter{0};
  std::error_code error;
  fs::create_directories(folder_, error);
  const fs::space_info space = fs::space(folder_, error);
  if (error || space.available < kReserveBytes + bytes.size()) return;
  const fs::path temporary = folder_ / fmt::format("{}{}-{}", kTemporary, ::getpid(), counter++);
  if (WriteWhole(temporary, Seal(key, bytes), bytes)) fs::rename(temporary, folder_ / key, error);
  fs::remove(temporary, error);
}

void FileCache::Trim() const {
  if (folder_.empty()) return;
  std::vector<Entry> entries = ListEntries(folder_);
  int64_t total = 0;
  for (const Entry& entry : entries) total += entry.bytes;
  std::sort(entries.begin(), entries.end(), [](const Entry& x, const Entry& y) {
    return x.used != y.used ? x.used < y.used : x.path < y.path;
  });
  std::error_code error;
  for (const Entry& entry : entries) {
    if (total <= max_bytes_) return;
    if (fs::remove(entry.path, error)) total -= entry.bytes;
  }
}

}  // namespace color3d
