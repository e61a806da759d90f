#include "client/studio/page_files.h"

#include <algorithm>
#include <array>
#include <cstddef>

// page_files.S
#define PAGE_FILE(name)                           \
  extern "C" const char color3d_##name##_begin[]; \
  extern "C" const char color3d_##name##_end[]
PAGE_FILE(studio_page);
PAGE_FILE(studio_style);
PAGE_FILE(studio_script);
#undef PAGE_FILE

namespace color3d::client {
namespace {

std::string_view BytesBetween(const char* begin, const char* end) {
  return {begin, static_cast<size_t>(end - begin)};
}

}  // namespace

const PageFile* FindPageFile(std::string_view path) {
  static const std::array<PageFile, 3> kFiles = {
      PageFile{"/",
               "text/html; charset=utf-8",
               BytesBetween(color3d_studio_page_begin, color3d_studio_page_end)},
      PageFile{"/studio.css",
               "text/css; charset=utf-8",
               BytesBetween(color3d_studio_style_begin, color3d_studio_style_end)},
      PageFile{"/studio.js",
               "text/javascript; charset=utf-8",
               BytesBetween(color3d_studio_script_begin, color3d_studio_script_end)}};
  const auto file = std::ranges::find(kFiles, path, &PageFile::path);
  return file == kFiles.end() ? nullptr : &*file;
}

}  // namespace color3d::client
