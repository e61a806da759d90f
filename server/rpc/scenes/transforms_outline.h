// Outline of a transforms.json, checked by the server before a worker reads it. Pure function.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace color3d {

struct TransformsOutline {
  bool is_object = false;  // well-formed JSON with an object at its root
  int64_t frames = 0;      // number of entries of the list "frames"
  std::string error;       // if not well-formed: "parse error at line 3, column 7: ..."
};

// Accepts common extensions of JSON (base/json_text.h). Parses without building a tree: memory is
// bounded by the longest string and the depth, not by the size of the file.
TransformsOutline OutlineOfTransforms(std::string_view json);

}  // namespace color3d
