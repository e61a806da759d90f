#include "core/base/range_check.h"

#include <sstream>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kDigits = 9;  // enough to tell a value just beyond the range from the end of it

}  // namespace

void RangeCheck::operator()(const char* field, double value, double low, double high) const {
  if (value >= low && value <= high) return;
  std::ostringstream message;
  message.precision(kDigits);
  message << options_ << ' ' << field << " is " << value << "; it must be " << low << " to "
          << high;
  throw InvalidArgument(message.str());
}

}  // namespace color3d
