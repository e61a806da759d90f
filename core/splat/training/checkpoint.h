// A training's state as bytes: what it is the state of, the values, and a digest over all of it.
// Internal to the splat module.
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
  // `fingerprint` holds everything that the course of the training depends on (options, scene).
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

// Reads back what a CheckpointWriter wrote, in the same order. Never reads beyond the end: ok()
// turns false instead, and what is read from then on is empty.
class CheckpointReader {
 public:
  // Not ok() for damaged bytes, another version of the format and another fingerprint.
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
  // A number of items of `item_bytes` each that follow; 0 and not ok() when they cannot all be
  // there.
  uint64_t Count(size_t item_bytes);

 private:
  bool Has(uint64_t bytes);
  void Copy(void* to, uint64_t bytes);

  std::string_view rest_;
  bool ok_ = true;
};

}  // namespace color3d
