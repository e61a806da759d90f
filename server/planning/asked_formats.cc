#include "server/planning/asked_formats.h"

#include "core/base/error.h"

namespace color3d {
namespace {
using google::protobuf::FieldDescriptor;

bool IsOn(const v1::ExportSpec& spec, const FieldDescriptor* field) {
  const auto* reflection = spec.GetReflection();
  return field->cpp_type() == FieldDescriptor::CPPTYPE_BOOL ? reflection->GetBool(spec, field)
                                                            : reflection->GetInt32(spec, field) > 0;
}

}  // namespace

std::set<ExportFormat> AskedFormats(const v1::ExportSpec& spec) {
  std::set<ExportFormat> formats;
  std::set<ExportFormat> with_others;
  for (const ExportFormatInfo& info : kExportFormats) {
    const FieldDescriptor* field = spec.GetDescriptor()->FindFieldByName(info.option);
    if (field == nullptr) {
      throw Error(ErrorCode::kInternal, "ExportSpec has no option '{}'", info.option);
    }
    if (spec.GetReflection()->HasField(spec, field)) {
      if (IsOn(spec, field)) formats.insert(info.format);
    } else if (info.by_default == ExportDefault::kOn ||
               (info.by_default == ExportDefault::kAsPly && formats.contains(ExportFormat::kPly))) {
      formats.insert(info.format);
    } else if (info.by_default == ExportDefault::kWithOthers) {
      with_others.insert(info.format);
    }
  }
  if (!formats.empty()) formats.merge(with_others);
  return formats;
}

}  // namespace color3d
