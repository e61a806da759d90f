// What the server wants to know of a transforms.json before a worker reads it. A pure function.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace color3d {

struct TransformsOutline {
  bool is_object = false;  // well-formed JSON, and an object
  int64_t frames = 0;      // entries of the list "frames"
  std::string error;       // where it is not well-formed: "parse error at line 3, column 7: ..."
};

// What other programs write beyond JSON (base/json_text.h) is well-formed. Reads along without
// building a tree: memory does not grow with the file, but for its longest string and its depth.
TransformsOutline OutlineOfTransforms(std::string_view json);

}  // namespace color3d
