#include "core/base/range_check.h"

#include "core/base/error.h"

namespace color3d {

void RangeCheck::operator()(const char* field, double value, double low, double high) const {
  if (value >= low && value <= high) return;
  // Nine digits distinguish a value just beyond the range from its end.
  throw InvalidArgument(
      "{} {} is {:.9g}; it must be {:.9g} to {:.9g}", options_, field, value, low, high);
}

}  // namespace color3d
