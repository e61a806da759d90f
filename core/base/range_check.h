// The range of a number in an options struct, checked and told alike everywhere. Stateless.
#pragma once

namespace color3d {

// For the Validate() of one struct of options; `options` names it in messages ("hint option").
class RangeCheck {
 public:
  explicit RangeCheck(const char* options) : options_(options) {}

  // Throws Error{kInvalidArgument} that names the field, its value and the range when `value` is
  // not in [low, high]; NaN never is.
  void operator()(const char* field, double value, double low, double high) const;

 private:
  const char* options_;
};

}  // namespace color3d
