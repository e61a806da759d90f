#include "client/options/option_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <numeric>

#include "core/base/error.h"
#include "core/base/text/lower_case.h"
#include "proto/option_text.h"

namespace color3d::client {
namespace {
using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::EnumValueDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

struct Option {
  const FieldDescriptor* stage = nullptr;  // null: option of the whole scene
  const FieldDescriptor* field = nullptr;
};

bool IsMessage(const FieldDescriptor* field) {
  return field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
}

// Numeric options of the whole scene. Its other fields have flags of their own.
bool IsOptionOfScene(const FieldDescriptor* field) { return InfoOf(field).has_min(); }

std::string OptionName(const Option& option) {
  return (option.stage == nullptr ? "" : option.stage->name() + ".") + option.field->name();
}

std::vector<Option> AllOptions() {
  std::vector<Option> options;
  const Descriptor* scene = v1::ColorizeSceneSpec::descriptor();
  for (int i = 0; i < scene->field_count(); ++i) {
    const FieldDescriptor* stage = scene->field(i);
    if (!IsMessage(stage) && IsOptionOfScene(stage)) options.push_back({nullptr, stage});
    if (!IsMessage(stage) || stage->is_repeated()) continue;
    for (int f = 0; f < stage->message_type()->field_count(); ++f) {
      const FieldDescriptor* field = stage->message_type()->field(f);
      // Sources of colour are not stages; lists and pictures have no single value.
      const bool is_value = !IsMessage(field) && !field->is_repeated();
      if (is_value && field->real_containing_oneof() == nullptr &&
          stage->message_type() != v1::KeyColorSource::descriptor()) {
        options.push_back({stage, field});
      }
    }
  }
  return options;
}

int EditDistance(const std::string& a, const std::string& b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (size_t i = 1; i <= a.size(); ++i) {
    int diagonal = row[0];
    row[0] = static_cast<int>(i);
    for (size_t j = 1; j <= b.size(); ++j) {
      const int replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

Option FindOption(const std::string& name) {
  std::vector<std::string> names, same_field, of_stage;
  for (const Option& option : AllOptions()) {
    const std::string known = OptionName(option);
    if (known == name) return option;
    names.push_back(known);
    if (option.field->name() == name) same_field.push_back(known);
    if (option.stage != nullptr && option.stage->name() == name) of_stage.push_back(known);
  }
  if (!of_stage.empty()) {
    throw InvalidArgument("'{}' is a stage; its options are {}", name, fmt::join(of_stage, ", "));
  }
  if (!same_field.empty()) {
    throw InvalidArgument("'{}' is an option of {}; write {}",
                          name,
                          same_field.size() == 1 ? "a stage" : "several stages",
                          fmt::join(same_field, " or "));
  }
  const std::string nearest = Nearest(name, names);
  throw InvalidArgument("there is no option '{}'{}",
                        name,
                        nearest.empty() ? "; proto/README.md lists them, `color3d server presets` "
                                          "shows some"
                                        : "; did you mean " + nearest + "?");
}

// Returns the common prefix of the values, e.g. "STRATEGY_".
std::string PrefixOf(const EnumDescriptor* values) {
  const std::string unspecified = "UNSPECIFIED";
  const std::string& first = values->value(0)->name();
  return first.substr(0, first.size() - std::min(first.size(), unspecified.size()));
}

const EnumValueDescriptor* FindValue(const EnumDescriptor* values, std::string text) {
  std::ranges::transform(
      text, text.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  const EnumValueDescriptor* value = values->FindValueByName(PrefixOf(values) + text);
  if (value == nullptr) value = values->FindValueByName(text);
  return value != nullptr && value->number() != 0 ? value : nullptr;
}

template <typename T>
bool Parse(const std::string& text, T* value) {
  const char* end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, *value);
  return result.ec == std::errc() && result.ptr == end;
}

// Accepted values of the field, for messages and --help.
std::string AcceptedValues(const FieldDescriptor* field) {
  const std::string range = RangeText(field);
  const std::string& unit = InfoOf(field).unit();
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return range + (unit.empty() ? "" : " " + unit);
    case FieldDescriptor::CPPTYPE_ENUM: {
      std::string names;
      const EnumDescriptor* values = field->enum_type();
      for (int i = 1; i < values->value_count(); ++i) {
        const std::string name =
            LowerCase(values->value(i)->name().substr(PrefixOf(values).size()));
        names += (i > 1 ? ", " : "") + name;
      }
      return names;
    }
    case FieldDescriptor::CPPTYPE_BOOL:
      return "true or false";
    default:
      return InfoOf(field).names() == v1::OptionInfo::NAMES_UNSPECIFIED
                 ? "text"
                 : "a name configured on the server";
  }
}

[[noreturn]] void Refuse(const Option& option, const std::string& value) {
  throw InvalidArgument(
      "{} is '{}'; it must be {}", OptionName(option), value, AcceptedValues(option.field));
}

void SetNumber(const Option& option, const std::string& text, Message* message) {
  const auto* reflection = message->GetReflection();
  int whole = 0;
  double number = 0.0;
  const bool is_integer = option.field->cpp_type() == FieldDescriptor::CPPTYPE_INT32;
  const bool is_number = is_integer ? Parse(text, &whole) : Parse(text, &number);
  if (!is_number || !RangeError(option.field, is_integer ? whole : number).empty()) {
    Refuse(option, text);
  }
  if (is_integer) {
    reflection->SetInt32(message, option.field, whole);
  } else {
    reflection->SetDouble(message, option.field, number);
  }
}

}  // namespace

std::string Nearest(const std::string& name, const std::vector<std::string>& names) {
  std::string nearest;
  int least = static_cast<int>(name.size()) / 2 + 1;  // beyond, names are not similar
  for (const std::string& known : names) {
    const int distance = EditDistance(name, known);
    if (distance < least) {
      least = distance;
      nearest = known;
    }
  }
  return nearest;
}

void SetOption(const std::string& setting, v1::ColorizeSceneSpec* spec) {
  const size_t equals = setting.find('=');
  const Option option = FindOption(setting.substr(0, equals));
  if (equals == std::string::npos) {
    throw InvalidArgument(
        "{} has no value; write {}=VALUE, with {}", setting, setting, AcceptedValues(option.field));
  }
  const std::string value = setting.substr(equals + 1);
  Message* message = spec;
  if (option.stage != nullptr) message = spec->GetReflection()->MutableMessage(spec, option.stage);
  const auto* reflection = message->GetReflection();
  switch (option.field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_ENUM: {
      const EnumValueDescriptor* known = FindValue(option.field->enum_type(), value);
      if (known == nullptr) Refuse(option, value);
      return reflection->SetEnum(message, option.field, known);
    }
    case FieldDescriptor::CPPTYPE_BOOL:
      if (value != "true" && value != "false") Refuse(option, value);
      return reflection->SetBool(message, option.field, value == "true");
    case FieldDescriptor::CPPTYPE_STRING:
      return reflection->SetString(message, option.field, value);
    default:
      return SetNumber(option, value, message);
  }
}

std::string DescribeOption(const std::string& name) {
  const FieldDescriptor* field = FindOption(name).field;
  const std::string& value = InfoOf(field).default_value();
  if (field->cpp_type() == FieldDescriptor::CPPTYPE_STRING) return AcceptedValues(field);
  return AcceptedValues(field) + ", default " + (value.empty() ? "by preset" : value);
}

}  // namespace color3d::client
