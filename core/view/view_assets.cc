#include "core/view/view_assets.h"

#include <cstddef>

// view_assets.S
#define ASSET(name)                               \
  extern "C" const char color3d_##name##_begin[]; \
  extern "C" const char color3d_##name##_end[]
ASSET(page_template);
ASSET(page_style);
ASSET(page_script);
ASSET(page_framed_script);
ASSET(page_shading_script);
ASSET(page_toned_still_script);
ASSET(page_motion_script);
ASSET(page_player_script);
ASSET(viewer_program);
ASSET(viewer_license);
#undef ASSET

namespace color3d {
namespace {

std::string_view Between(const char* begin, const char* end) {
  return {begin, static_cast<size_t>(end - begin)};
}

}  // namespace

std::string_view PageTemplate() {
  return Between(color3d_page_template_begin, color3d_page_template_end);
}
std::string_view PageStyle() { return Between(color3d_page_style_begin, color3d_page_style_end); }
std::string_view PageScript() {
  return Between(color3d_page_script_begin, color3d_page_script_end);
}
std::string_view PageFramedScript() {
  return Between(color3d_page_framed_script_begin, color3d_page_framed_script_end);
}
std::string_view PageShadingScript() {
  return Between(color3d_page_shading_script_begin, color3d_page_shading_script_end);
}
std::string_view PageTonedStillScript() {
  return Between(color3d_page_toned_still_script_begin, color3d_page_toned_still_script_end);
}
std::string_view PageMotionScript() {
  return Between(color3d_page_motion_script_begin, color3d_page_motion_script_end);
}
std::string_view PagePlayerScript() {
  return Between(color3d_page_player_script_begin, color3d_page_player_script_end);
}
std::string_view ViewerProgram() {
  return Between(color3d_viewer_program_begin, color3d_viewer_program_end);
}
std::string_view ViewerLicense() {
  return Between(color3d_viewer_license_begin, color3d_viewer_license_end);
}
std::string_view ViewerName() { return COLOR3D_VIEWER_NAME; }

}  // namespace color3d
