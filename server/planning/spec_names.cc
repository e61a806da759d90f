#include "server/planning/spec_names.h"

#include "proto/option_text.h"
#include "server/base/service_error.h"

namespace color3d {
namespace {
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

void Collect(const Message& message, const std::string& path, SpecNames* names) {
  const Reflection* reflection = message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection->ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    const std::string here = path.empty() ? field->name() : path + "." + field->name();
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      if (!field->is_repeated()) {
        Collect(reflection->GetMessage(message, field), here, names);
        continue;
      }
      for (int i = 0; i < reflection->FieldSize(message, field); ++i) {
        Collect(reflection->GetRepeatedMessage(message, field, i),
                fmt::format("{}[{}]", here, i),
                names);
      }
      continue;
    }
    const v1::OptionInfo::Names kind = InfoOf(field).names();
    if (kind == v1::OptionInfo::NAMES_UNSPECIFIED) continue;
    const std::string name = reflection->GetString(message, field);
    if (name.empty()) continue;
    (kind == v1::OptionInfo::NAMES_MODEL ? names->models : names->backends).push_back({here, name});
  }
}

template <typename Value>
void Require(const std::vector<NameUse>& uses,
             const std::map<std::string, Value>& known,
             const std::string& what,
             ErrorReason reason,
             const std::string& remedy) {
  for (const NameUse& use : uses) {
    if (known.contains(use.name)) continue;
    const std::string why = fmt::format(
        " names the {} '{}', which this server does not have (it has: {}); start it with {}",
        what,
        use.name,
        NamesOf(known),
        remedy);
    throw ServiceError(reason, use.field + why, {{use.field, use.field + why}});
  }
}

}  // namespace

SpecNames NamesIn(const v1::JobSpec& spec) {
  SpecNames names;
  Collect(spec, "", &names);
  return names;
}

void CheckNames(const v1::JobSpec& spec, const UserModels& models) {
  const SpecNames names = NamesIn(spec);
  Require(names.models, models.files, "model", ErrorReason::kUnknownModel, "--model NAME=FILE");
  Require(names.backends,
          models.backends,
          "backend",
          ErrorReason::kUnknownBackend,
          "--backend NAME=ADDRESS");
}

}  // namespace color3d
