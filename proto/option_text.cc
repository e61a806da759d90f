#include "proto/option_text.h"

#include <fmt/format.h>

#include <cmath>

namespace color3d {
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;

const v1::OptionInfo& InfoOf(const FieldDescriptor* field) {
  return field->options().GetExtension(v1::option);
}

std::string NumberText(double value) { return fmt::format("{:.12g}", value); }

std::string RangeText(const FieldDescriptor* field) {
  const v1::OptionInfo& info = InfoOf(field);
  if (!info.has_min() || !info.has_max()) return "";
  return fmt::format("{} to {}", NumberText(info.min()), NumberText(info.max()));
}

std::string ValuesText(const FieldDescriptor* field) {
  const EnumDescriptor* values = field->enum_type();
  std::string text;
  for (int i = 1; i < values->value_count(); ++i) {  // the first is "unspecified"
    text += (i > 1 ? ", " : "") + values->value(i)->name();
  }
  return text;
}

std::string RangeError(const FieldDescriptor* field, double value) {
  if (!std::isfinite(value)) return " is not a finite number";
  const v1::OptionInfo& info = InfoOf(field);
  const bool too_small = info.has_min() && value < info.min();
  const bool too_large = info.has_max() && value > info.max();
  if (!too_small && !too_large) return "";
  return fmt::format(" is {}; the range is {}", value, RangeText(field));
}

}  // namespace color3d
