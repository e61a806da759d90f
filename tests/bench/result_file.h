// Output of benchmarks.
#pragma once

#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "core/base/files.h"

namespace color3d {

// Writes to `json_file`, or to standard output if it is empty.
inline void WriteResult(const nlohmann::ordered_json& result, const std::string& json_file) {
  const std::string text = result.dump(1) + "\n";
  if (json_file.empty()) {
    std::printf("%s", text.c_str());
  } else {
    WriteFileAtomic(json_file, text);
  }
}

}  // namespace color3d
