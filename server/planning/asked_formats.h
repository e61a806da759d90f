// The formats that the options of an export ask for. Pure functions.
#pragma once

#include <set>

#include "color3d/v1/stage.pb.h"
#include "core/catalogue/export_formats.h"

namespace color3d {

// Fields that are unset count as their row in export_formats.h says. Empty: nothing is to be
// written.
std::set<ExportFormat> AskedFormats(const v1::ExportSpec& spec);

}  // namespace color3d
