// What an option takes (color3d/v1/option.proto), for checks and in the words of messages, --help
// and the reference. Pure functions.
#pragma once

#include <google/protobuf/descriptor.h>

#include <string>

#include "color3d/v1/option.pb.h"

namespace color3d {

const v1::OptionInfo& InfoOf(const google::protobuf::FieldDescriptor* field);

// As people write it: "0.05", "100000".
std::string NumberText(double value);
// "64 to 4096"; empty for a field without a range.
std::string RangeText(const google::protobuf::FieldDescriptor* field);
// The values of an enum that mean something: "PRESET_FAST, PRESET_BEST, PRESET_PAPER".
std::string ValuesText(const google::protobuf::FieldDescriptor* field);

// Why the field does not take the number: " is -5; the range is 64 to 4096"; empty when it does.
std::string WhyRefused(const google::protobuf::FieldDescriptor* field, double value);

}  // namespace color3d
