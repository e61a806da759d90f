// The files of the presets, compiled in (preset_files.cc is made by CMake).
#pragma once

#include <vector>

namespace color3d {

struct PresetFile {
  const char* name;  // without ".textproto"
  const char* text;
};
const std::vector<PresetFile>& PresetFiles();

}  // namespace color3d
