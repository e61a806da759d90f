#include "core/catalogue/export_formats.h"

#include <iterator>

#include "core/base/error.h"

namespace color3d {

const ExportFormatInfo& InfoOf(ExportFormat format) {
  for (const ExportFormatInfo& info : kExportFormats) {
    if (info.format == format) return info;
  }
  throw Error(
      ErrorCode::kInternal, "there is no export format of number {}", static_cast<int>(format));
}

std::set<ExportFormat> DefaultExportFormats() {
  std::set<ExportFormat> formats;
  for (const ExportFormatInfo& info : kExportFormats) {
    if (info.by_default != ExportDefault::kOff) formats.insert(info.format);
  }
  return formats;
}

std::string ExportFormatNames() {
  std::string names;
  const size_t count = std::size(kExportFormats);
  for (size_t i = 0; i < count; ++i) {
    const char* separator = i == 0 ? "" : i + 1 == count ? " or " : ", ";
    names += separator + std::string(kExportFormats[i].option);
  }
  return names;
}

}  // namespace color3d
