// The studio's page, as bundled by the build. Constants; thread-safe.
#pragma once

#include <string_view>

namespace color3d::client {

struct PageFile {
  const char* path;  // of the address
  const char* media_type;
  std::string_view bytes;
};

// Returns nullptr if there is no such file.
const PageFile* FindPageFile(std::string_view path);

}  // namespace color3d::client
