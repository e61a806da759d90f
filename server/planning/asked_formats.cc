#include "server/planning/asked_formats.h"

#include "core/base/error.h"

namespace color3d {
namespace {
using google::protobuf::FieldDescriptor;
using google::protobuf::Reflection;

bool IsSet(const v1::ExportSpec& spec, const FieldDescriptor* field) {
  return spec.GetReflection()->HasField(spec, field);
}

bool IsOn(const v1::ExportSpec& spec, const FieldDescriptor* field) {
  const Reflection* reflection = spec.GetReflection();
  return field->cpp_type() == FieldDescriptor::CPPTYPE_BOOL ? reflection->GetBool(spec, field)
                                                            : reflection->GetInt32(spec, field) > 0;
}

bool IsDefaultOn(ExportDefault by_default, const std::set<ExportFormat>& formats) {
  switch (by_default) {
    case ExportDefault::kOff:
      return false;
    case ExportDefault::kOn:
      return true;
    case ExportDefault::kAsPly:
      return formats.contains(ExportFormat::kPly);
    case ExportDefault::kWithOthers:
      return !formats.empty();
  }
  return false;
}

}  // namespace

std::set<ExportFormat> AskedFormats(const v1::ExportSpec& spec) {
  std::set<ExportFormat> formats;
  const auto add = [&](bool with_others) {
    for (const ExportFormatInfo& info : kExportFormats) {
      if ((info.by_default == ExportDefault::kWithOthers) != with_others) continue;
      const FieldDescriptor* field = spec.GetDescriptor()->FindFieldByName(info.option);
      if (field == nullptr) {
        throw Error(ErrorCode::kInternal, "ExportSpec has no option '{}'", info.option);
      }
      const bool on =
          IsSet(spec, field) ? IsOn(spec, field) : IsDefaultOn(info.by_default, formats);
      if (on) formats.insert(info.format);
    }
  };
  add(/*with_others=*/false);
  add(/*with_others=*/true);  // these depend on the others
  return formats;
}

}  // namespace color3d
