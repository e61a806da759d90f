// color3d-api-reference: writes the generated part of proto/README.md from the comments and options
// of the protos and the preset files.
//   color3d-api-reference DESCRIPTOR_SET PRESETS_FOLDER README [--check]
// With --check it changes nothing and exits with 1 if the README is out of date.
#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/text_format.h>

#include <fstream>
#include <iostream>
#include <iterator>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "color3d/v1/colorize_scene.pb.h"
#include "proto/option_text.h"

namespace color3d {
namespace {
using google::protobuf::Descriptor;
using google::protobuf::DescriptorPool;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptor;
using google::protobuf::ServiceDescriptor;
using google::protobuf::SourceLocation;
using google::protobuf::TextFormat;

constexpr char kMarker[] = "<!-- Below: written by color3d-api-reference. -->\n";
const std::vector<std::string> kPresets = {"fast", "best", "paper"};
const std::vector<std::string> kServiceFiles = {"color3d/v1/scene.proto",
                                                "color3d/v1/blob.proto",
                                                "color3d/v1/job.proto",
                                                "color3d/v1/colorizer.proto",
                                                "color3d/v1/server.proto",
                                                "color3d/v1/admin.proto",
                                                "color3d/backend/v1/backend.proto"};
const std::vector<std::string> kOptionFiles = {
    "color3d/v1/colorize_scene.proto", "color3d/v1/key_view.proto", "color3d/v1/stage.proto"};

std::string ReadText(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error("cannot read " + file);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Leading comment of a descriptor as one line of a Markdown table.
template <typename T>
std::string Comment(const T* described) {
  SourceLocation location;
  if (!described->GetSourceLocation(&location)) return "";
  std::string line;
  for (const char c : location.leading_comments) {
    if (c == '|') line += '\\';
    const bool is_space = c == '\n' || c == ' ';
    if (!is_space) {
      line += c;
    } else if (!line.empty() && line.back() != ' ') {
      line += ' ';
    }
  }
  while (!line.empty() && line.back() == ' ') line.pop_back();
  return line;
}

class Reference {
 public:
  Reference(const std::string& descriptor_set, const std::string& presets_folder) {
    google::protobuf::FileDescriptorSet files;
    if (!files.ParseFromString(ReadText(descriptor_set))) {
      throw std::runtime_error(descriptor_set + " is not a descriptor set");
    }
    for (const auto& file : files.file()) {
      if (pool_.BuildFile(file) == nullptr) throw std::runtime_error(file.name() + " is invalid");
    }
    for (const std::string& name : kPresets) {
      presets_.emplace_back();
      const std::string text = ReadText(presets_folder + "/" + name + ".textproto");
      if (!TextFormat::ParseFromString(text, &presets_.back())) {
        throw std::runtime_error("the preset " + name + " cannot be read");
      }
    }
  }

  std::string Text() {
    std::string text = "\n## Services\n";
    for (const std::string& file : kServiceFiles) {
      const FileDescriptor* descriptor = File(file);
      for (int i = 0; i < descriptor->service_count(); ++i) text += Service(descriptor->service(i));
    }
    text +=
        "\n## Options\n\nRanges are inclusive. If the presets differ, the default of each is "
        "listed. An "
        "option without a default is omitted unless it is set.\n";
    text += Section("colorize_scene",
                    File(kOptionFiles[0])->FindMessageTypeByName("ColorizeSceneSpec"));
    const Descriptor* job = pool_.FindMessageTypeByName("color3d.v1.JobSpec");
    const auto* stages = job->FindOneofByName("stage");
    for (int i = 1; i < stages->field_count(); ++i) {  // the first is colorize_scene
      text += Section(stages->field(i)->name(), stages->field(i)->message_type());
    }
    text += "\n## Types of options\n";
    for (const std::string& file : kOptionFiles) {
      const FileDescriptor* descriptor = File(file);
      for (int i = 0; i < descriptor->message_type_count(); ++i) {
        text += Section("", descriptor->message_type(i));
      }
      for (int i = 0; i < descriptor->enum_type_count(); ++i) {
        text += fmt::format("\n### {0}\n\n{1}\n\n{2}",
                            descriptor->enum_type(i)->name(),
                            Comment(descriptor->enum_type(i)),
                            Values(descriptor->enum_type(i)));
      }
    }
    return text;
  }

 private:
  const FileDescriptor* File(const std::string& name) const {
    const FileDescriptor* file = pool_.FindFileByName(name);
    if (file == nullptr) throw std::runtime_error("there is no " + name);
    return file;
  }

  static std::string Service(const ServiceDescriptor* service) {
    std::string text = fmt::format(
        "\n### {}\n\n{}\n\n| Method | |\n|---|---|\n", service->name(), Comment(service));
    for (int i = 0; i < service->method_count(); ++i) {
      const auto* method = service->method(i);
      text += fmt::format("| `{}({}{}) → {}{}` | {} |\n",
                          method->name(),
                          method->client_streaming() ? "stream " : "",
                          method->input_type()->name(),
                          method->server_streaming() ? "stream " : "",
                          method->output_type()->name(),
                          Comment(method));
    }
    return text;
  }

  static std::string Values(const EnumDescriptor* values) {
    std::string text;
    for (int i = 1; i < values->value_count(); ++i) {  // the first is "unspecified"
      const std::string comment = Comment(values->value(i));
      text += fmt::format(
          "- `{}`{}{}\n", values->value(i)->name(), comment.empty() ? "" : ": ", comment);
    }
    return text;
  }

  static std::string Type(const FieldDescriptor* field) {
    const std::string repeated = field->is_repeated() ? "list of " : "";
    if (field->message_type() != nullptr) return repeated + field->message_type()->name();
    if (field->enum_type() != nullptr) return repeated + field->enum_type()->name();
    return repeated + field->type_name();
  }

  static std::string Takes(const FieldDescriptor* field) {
    const v1::OptionInfo& info = InfoOf(field);
    if (info.max_count() > 0) return fmt::format("at most {}", info.max_count());
    if (info.max_bytes() > 0) return fmt::format("at most {} bytes", info.max_bytes());
    if (info.names() == v1::OptionInfo::NAMES_MODEL) return "name of a model";
    if (info.names() == v1::OptionInfo::NAMES_BACKEND) return "name of a backend";
    return RangeText(field) + (info.unit().empty() ? "" : " " + info.unit());
  }

  // Value of a stage's field in a preset; empty: not set. `stage` is empty for fields of the scene.
  static std::string ValueIn(const v1::ColorizeSceneSpec& preset,
                             const std::string& stage,
                             const FieldDescriptor* field) {
    const google::protobuf::Message* options = &preset;
    const auto* reflection = preset.GetReflection();
    if (!stage.empty()) {
      const FieldDescriptor* part = preset.GetDescriptor()->FindFieldByName(stage);
      if (part == nullptr || !reflection->HasField(preset, part)) return "";
      options = &reflection->GetMessage(preset, part);
      reflection = options->GetReflection();
    }
    const FieldDescriptor* own = options->GetDescriptor()->FindFieldByName(field->name());
    if (own == nullptr || own->is_repeated() || own->message_type() != nullptr ||
        !reflection->HasField(*options, own)) {
      return "";
    }
    std::string value;
    TextFormat::PrintFieldValueToString(*options, own, -1, &value);
    return value;
  }

  std::string Default(const std::string& kind, const FieldDescriptor* field) const {
    const std::string& value = InfoOf(field).default_value();
    const std::string stage = kind == "colorize_scene" ? "" : kind;
    if (kind.empty() || (stage.empty() && field->name() == "preset")) return value;
    std::vector<std::string> by_preset;
    std::set<std::string> distinct;
    for (size_t i = 0; i < kPresets.size(); ++i) {
      const std::string set = ValueIn(presets_[i], stage, field);
      const std::string& holds = set.empty() ? value : set;
      distinct.insert(holds);
      if (!holds.empty()) by_preset.push_back(kPresets[i] + " " + holds);
    }
    if (distinct.size() == 1) return *distinct.begin();
    return fmt::format("{}", fmt::join(by_preset, ", "));
  }

  // Table of the fields of a message, once; `kind` is empty for messages that are not stages.
  std::string Section(const std::string& kind, const Descriptor* message) {
    if (!done_.insert(message->full_name()).second) return "";
    std::string text =
        fmt::format("\n### {}\n\n{}\n",
                    kind.empty() ? message->name() : fmt::format("`{}`: {}", kind, message->name()),
                    Comment(message));
    if (message->field_count() > 0) {
      text += "\n| Option | Type | Range | Default | |\n|---|---|---|---|---|\n";
    }
    for (int i = 0; i < message->field_count(); ++i) {
      const FieldDescriptor* field = message->field(i);
      text += fmt::format("| `{}` | {} | {} | {} | {} |\n",
                          field->name(),
                          Type(field),
                          Takes(field),
                          Default(kind, field),
                          Comment(field));
    }
    for (int i = 0; i < message->enum_type_count(); ++i) {
      const EnumDescriptor* values = message->enum_type(i);
      const std::string comment = Comment(values);
      text += fmt::format(
          "\n{}:{}{}\n\n{}", values->name(), comment.empty() ? "" : " ", comment, Values(values));
    }
    for (int i = 0; i < message->nested_type_count(); ++i) {
      text += Section("", message->nested_type(i));
    }
    return text;
  }

  DescriptorPool pool_;
  std::vector<v1::ColorizeSceneSpec> presets_;  // in the order of kPresets
  std::set<std::string> done_;                  // messages already written
};

int Main(const std::vector<std::string>& arguments) {
  if (arguments.size() < 3) {
    std::cerr << "usage: color3d-api-reference DESCRIPTOR_SET PRESETS_FOLDER README [--check]\n";
    return 2;
  }
  const std::string before = ReadText(arguments[2]);
  const size_t marker = before.find(kMarker);
  if (marker == std::string::npos) {
    throw std::runtime_error(arguments[2] + " lacks the line " + kMarker);
  }
  const std::string after =
      before.substr(0, marker) + kMarker + Reference(arguments[0], arguments[1]).Text();
  if (after == before) return 0;
  if (arguments.size() > 3 && arguments[3] == "--check") {
    std::cerr << arguments[2] << " is out of date; build the target api-reference\n";
    return 1;
  }
  std::ofstream(arguments[2], std::ios::binary) << after;
  return 0;
}

}  // namespace
}  // namespace color3d

int main(int argc, char** argv) {
  try {
    return color3d::Main({argv + 1, argv + argc});
  } catch (const std::exception& e) {
    std::cerr << "color3d-api-reference: " << e.what() << "\n";
    return 2;
  }
}
