// Options of the stage export.
#pragma once

#include <set>

#include "core/catalogue/export_formats.h"

namespace color3d {

struct ExportOptions {
  std::set<ExportFormat> formats = DefaultExportFormats();
  int spz_version = 4;  // 4, or 2 for older readers
  // Adds a property "confidence" to the PLY, which strict viewers may refuse. Has no effect on a
  // model without provenance.
  bool confidence = false;
  // Number of PLYs that ExportFormat::kMoments writes, evenly over the time of the scene, 1..1000.
  int moments = 0;
  void Validate() const;  // throws Error{kInvalidArgument}
  bool operator==(const ExportOptions&) const = default;
};

}  // namespace color3d
