// Sequential reader of the bytes of a pickle. For this folder only.
#pragma once

#include <fmt/core.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/bytes/byte_source.h"

namespace color3d {

class PickleBytes {
 public:
  // `source` names the file in messages. Both must outlive the object.
  PickleBytes(std::string_view bytes, const ByteSource& source) : bytes_(bytes), source_(source) {}

  // All of these throw Damaged() if the bytes end too early.
  std::string_view Take(uint64_t count) {
    if (count > bytes_.size() - position_) throw Damaged("ends in the middle of an instruction");
    position_ += count;
    return bytes_.substr(position_ - count, count);
  }
  template <typename Number>
  Number Read() {
    Number value;
    std::memcpy(&value, Take(sizeof(value)).data(), sizeof(value));
    return value;
  }
  uint8_t ReadByte() { return Read<uint8_t>(); }
  // Reads up to the end of the line, which is skipped.
  std::string_view ReadLine() {
    const size_t end = bytes_.find('\n', position_);
    if (end == std::string_view::npos) throw Damaged("ends in the middle of a name");
    const std::string_view line = Take(end - position_);
    ++position_;
    return line;
  }

  // "FILE: its pickle WHAT (byte N)".
  Error Damaged(const std::string& what) const {
    return source_.Refusal("its pickle {} (byte {})", what, position_);
  }
  template <typename First, typename... Rest>
  Error Damaged(fmt::format_string<First, Rest...> what, First&& first, Rest&&... rest) const {
    return Damaged(fmt::format(what, std::forward<First>(first), std::forward<Rest>(rest)...));
  }
  const ByteSource& source() const { return source_; }

 private:
  std::string_view bytes_;
  const ByteSource& source_;
  size_t position_ = 0;
};

}  // namespace color3d
