// Serialized training state: fingerprint, values, and a digest over both. Internal to the splat
// module.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/splat/model/parameter_block.h"

namespace color3d {

// Both have the same calls, so that one function can write and read a state.
class CheckpointWriter {
 public:
  // `fingerprint` identifies all inputs that determine the training (options, scene).
  explicit CheckpointWriter(std::string_view fingerprint);

  template <class T>
  void Value(const T& value) {
    Append(&value, 1);
  }
  template <class T, class Allocator>
  void Vector(const std::vector<T, Allocator>& values) {
    Value<uint64_t>(values.size());
    Append(values.data(), values.size());
  }
  void Block(const ParameterBlock& block);
  // Call it last.
  std::string Finish() &&;

 private:
  template <class T>
  void Append(const T* values, size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(T));
  }
  void Text(std::string_view text);

  std::string bytes_;
};

// Reads the output of a CheckpointWriter in the same order. Never reads beyond the end: ok()
// becomes false, and further values are unchanged or empty.
class CheckpointReader {
 public:
  // Not ok() for damaged bytes, another format version or another fingerprint.
  CheckpointReader(std::string_view bytes, std::string_view fingerprint);

  bool ok() const { return ok_; }
  template <class T>
  void Value(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    Copy(&value, sizeof(T));
  }
  template <class T, class Allocator>
  void Vector(std::vector<T, Allocator>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    values.resize(Count(sizeof(T)));
    Copy(values.data(), values.size() * sizeof(T));
  }
  void Block(ParameterBlock& block);

 private:
  // Number of following items of `item_bytes` each; 0 and not ok() if the remaining bytes are
  // fewer.
  uint64_t Count(size_t item_bytes);
  std::string_view Text();
  bool Has(uint64_t bytes);
  void Copy(void* to, uint64_t bytes);

  std::string_view rest_;
  bool ok_ = true;
};

}  // namespace color3d
