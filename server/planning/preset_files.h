// The preset files, compiled in (CMake generates preset_files.cc).
#pragma once

#include <vector>

namespace color3d {

struct PresetFile {
  const char* name;  // without ".textproto"
  const char* text;
};
const std::vector<PresetFile>& PresetFiles();

}  // namespace color3d
