#include "client/options/preset_file.h"

#include <fmt/format.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/text_format.h>

#include <filesystem>
#include <regex>
#include <vector>

#include "client/options/option_fields.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/base/text/json_text.h"
#include "core/base/text/lower_case.h"
#include "proto/option_text.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {
using google::protobuf::Descriptor;
using google::protobuf::DescriptorPool;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::TextFormat;

const std::string kPrefix = "PRESET_";

v1::Preset PresetNamed(const std::string& name) {
  const auto* presets = v1::Preset_descriptor();
  for (int i = 1; i < presets->value_count(); ++i) {
    const auto* preset = presets->value(i);
    if (LowerCase(preset->name().substr(kPrefix.size())) == name) {
      return static_cast<v1::Preset>(preset->number());
    }
  }
  return v1::PRESET_UNSPECIFIED;
}

[[noreturn]] void Complain(const std::string& file, int line, const std::string& what) {
  throw InvalidArgument("--preset {}, line {}: {}", file, line + 1, what);
}

// Message of the parser with a remedy. Adds the known fields to `has no field named "x"`.
std::string WithRemedy(const std::string& complaint) {
  static const std::regex unknown("Message type \"([\\w.]+)\" has no field named \"(\\w+)\"\\.?");
  std::smatch match;
  if (std::regex_search(complaint, match, unknown)) {
    const Descriptor* type = DescriptorPool::generated_pool()->FindMessageTypeByName(match[1]);
    std::vector<std::string> names;
    for (int i = 0; type != nullptr && i < type->field_count(); ++i) {
      names.push_back(type->field(i)->name());
    }
    const std::string nearest = Nearest(match[2], names);
    return fmt::format("there is no field '{}'; {}",
                       match[2].str(),
                       nearest.empty() ? fmt::format("there are {}", fmt::join(names, ", "))
                                       : "did you mean " + nearest + "?");
  }
  return complaint + "; `color3d server presets fast` prints a valid preset";
}

struct FirstError : public google::protobuf::io::ErrorCollector {
  void AddError(int at, google::protobuf::io::ColumnNumber, const std::string& what) override {
    if (!text.empty()) return;
    line = at;
    text = what;
  }
  int line = 0;
  std::string text;
};

// Checks ranges. Errors name the line of the value.
void CheckValues(const Message& message,
                 const TextFormat::ParseInfoTree& lines,
                 const std::string& file) {
  const auto* reflection = message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection->ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    if (field->is_repeated()) continue;
    double value = 0.0;
    switch (field->cpp_type()) {
      case FieldDescriptor::CPPTYPE_MESSAGE:
        CheckValues(
            reflection->GetMessage(message, field), *lines.GetTreeForNested(field, -1), file);
        continue;
      case FieldDescriptor::CPPTYPE_INT32:
        value = reflection->GetInt32(message, field);
        break;
      case FieldDescriptor::CPPTYPE_DOUBLE:
        value = reflection->GetDouble(message, field);
        break;
      default:
        continue;
    }
    const std::string why = RangeError(field, value);
    if (!why.empty()) Complain(file, lines.GetLocation(field, -1).line, field->name() + why);
  }
}

void RejectSceneSpecificFields(const v1::ColorizeSceneSpec& spec, const std::string& file) {
  const bool one_scene = !spec.key_view().empty() || spec.has_key_color() ||
                         spec.colorize_key_view().has_source() || !spec.truth().empty() ||
                         !spec.training_truth().empty();
  if (!one_scene) return;
  throw InvalidArgument(
      "--preset {}: a preset is for any scene; remove key_view, key_color, source, truth and "
      "training_truth, and give the key view and its colour by flags",
      file);
}

}  // namespace

std::string PresetNames() {
  std::vector<std::string> names;
  const auto* presets = v1::Preset_descriptor();
  for (int i = 1; i < presets->value_count(); ++i) {
    names.push_back(LowerCase(presets->value(i)->name().substr(kPrefix.size())));
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

v1::ColorizeSceneSpec ReadPreset(const std::string& name_or_file) {
  v1::ColorizeSceneSpec spec;
  const v1::Preset preset = PresetNamed(name_or_file);
  if (preset != v1::PRESET_UNSPECIFIED) {
    spec.set_preset(preset);
    return spec;
  }
  if (!IsFile(name_or_file)) {
    throw Error(ErrorCode::kNotFound,
                "--preset {}: there is no such preset (there are {}) and no such file",
                name_or_file,
                PresetNames());
  }
  FirstError complaint;
  TextFormat::ParseInfoTree lines;
  TextFormat::Parser parser;
  parser.RecordErrorsTo(&complaint);
  parser.WriteLocationsTo(&lines);
  const std::string text = ReadFile(name_or_file);
  if (!parser.ParseFromString(std::string(WithoutMark(text, name_or_file)), &spec)) {
    Complain(name_or_file, complaint.line, WithRemedy(complaint.text));
  }
  CheckValues(spec, lines, name_or_file);
  RejectSceneSpecificFields(spec, name_or_file);
  return spec;
}

}  // namespace color3d::client
