// Serialized training state: fingerprint, values, and a digest over both. Internal to the splat
// module.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "core/splat/model/parameter_block.h"

namespace color3d {

class CheckpointWriter {
 public:
  // `fingerprint` identifies all inputs that determine the training (options, scene).
  explicit CheckpointWriter(std::string_view fingerprint);

  template <class T>
  void Value(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T));
  }
  void Text(std::string_view text);
  void Block(const ParameterBlock& block);
  void Vector(const AlignedFloats& values);
  // Call it last.
  std::string Finish() &&;

 private:
  void Floats(const float* values, size_t count);

  std::string bytes_;
};

// Reads the output of a CheckpointWriter in the same order. Never reads beyond the end: ok()
// becomes false, and further values are empty.
class CheckpointReader {
 public:
  // Not ok() for damaged bytes, another format version or another fingerprint.
  CheckpointReader(std::string_view bytes, std::string_view fingerprint);
  bool ok() const { return ok_; }

  template <class T>
  T Value() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value{};
    Copy(&value, sizeof(T));
    return value;
  }
  std::string_view Text();
  ParameterBlock Block();
  AlignedFloats Vector();
  // Number of following items of `item_bytes` each; 0 and not ok() if the remaining bytes are
  // fewer.
  uint64_t Count(size_t item_bytes);

 private:
  bool Has(uint64_t bytes);
  void Copy(void* to, uint64_t bytes);

  std::string_view rest_;
  bool ok_ = true;
};

}  // namespace color3d
