// Texts about the options of the API (color3d/v1/option.proto), for checks, messages, --help and
// the reference. Pure functions.
#pragma once

#include <google/protobuf/descriptor.h>

#include <string>

#include "color3d/v1/option.pb.h"

namespace color3d {

const v1::OptionInfo& InfoOf(const google::protobuf::FieldDescriptor* field);

// Returns the number in its shortest form: "0.05", "100000".
std::string NumberText(double value);
// Returns "64 to 4096", or an empty string for a field without a range.
std::string RangeText(const google::protobuf::FieldDescriptor* field);
// Returns the values of an enum except the unspecified one: "PRESET_FAST, PRESET_BEST,
// PRESET_PAPER".
std::string ValuesText(const google::protobuf::FieldDescriptor* field);

// Returns why the field refuses the number: " is -5; the range is 64 to 4096"; empty if it accepts
// it.
std::string RangeError(const google::protobuf::FieldDescriptor* field, double value);

}  // namespace color3d
