// Range checks for numbers in option structs, with uniform messages. Stateless.
#pragma once

namespace color3d {

// For the Validate() of one option struct; `options` is its name in messages ("hint option").
class RangeCheck {
 public:
  explicit RangeCheck(const char* options) : options_(options) {}

  // Throws Error{kInvalidArgument} with the field's name, value and range if `value` is not in
  // [low, high]. NaN is out of every range.
  void operator()(const char* field, double value, double low, double high) const;

 private:
  const char* options_;
};

}  // namespace color3d
