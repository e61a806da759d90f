// Source of bytes for readers of untrusted files: a file or memory. Files are not mapped, so that a
// file that shrinks while it is read causes an error instead of a signal, and the resident memory
// is what the reader keeps. Immutable, thread-safe.
#pragma once

#include <fmt/core.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/error.h"

namespace color3d {

class ByteSource {
 public:
  virtual ~ByteSource() = default;
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;

  uint64_t size() const { return size_; }
  // Copies `count` bytes from `offset` to `out`. Throws Error{kInvalidArgument} if the range is
  // not inside the source, kDataLoss if the file cannot be read.
  void ReadAt(uint64_t offset, uint64_t count, void* out) const;
  std::string ReadString(uint64_t offset, uint64_t count) const;
  // Returns an Error{kInvalidArgument} naming the source and the reason.
  Error Refusal(const std::string& reason) const;
  // Formats the reason as fmt::format does.
  template <typename First, typename... Rest>
  Error Refusal(fmt::format_string<First, Rest...> reason, First&& first, Rest&&... rest) const {
    return Refusal(fmt::format(reason, std::forward<First>(first), std::forward<Rest>(rest)...));
  }

 protected:
  ByteSource(std::string name, uint64_t size) : name_(std::move(name)), size_(size) {}
  virtual void DoRead(uint64_t offset, uint64_t count, char* out) const = 0;
  const std::string& name() const { return name_; }

 private:
  std::string name_;
  uint64_t size_;
};

// The bytes must outlive the source. `name` starts the messages.
class MemorySource : public ByteSource {
 public:
  explicit MemorySource(std::string_view bytes, const std::string& name = "the file");

 private:
  void DoRead(uint64_t offset, uint64_t count, char* out) const override;
  std::string_view bytes_;
};

// Throws Error{kNotFound} if there is no such regular file, kFailedPrecondition if it cannot be
// opened.
class FileSource : public ByteSource {
 public:
  explicit FileSource(const std::filesystem::path& path);
  ~FileSource() override;

 private:
  struct Opened {
    int descriptor;
    uint64_t size;
  };
  static Opened Open(const std::filesystem::path& path);
  FileSource(const std::filesystem::path& path, const Opened& opened);
  void DoRead(uint64_t offset, uint64_t count, char* out) const override;
  int descriptor_;
};

// Formats a name from a file for messages: quoted, at most 100 characters, with '?' for bytes that
// are not printable ASCII.
std::string QuotedName(std::string_view name);

}  // namespace color3d
