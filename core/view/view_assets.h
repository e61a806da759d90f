// The embedded text files of a page.
#pragma once

#include <string_view>

namespace color3d {

std::string_view PageTemplate();  // page/page.html
std::string_view PageStyle();     // page/page.css
std::string_view PageScript();    // page/page.js
// Before it.
std::string_view PageFramedScript();      // page/framed.js
std::string_view PageShadingScript();     // page/shading.js
std::string_view PageTonedStillScript();  // page/toned_still.js

// For scenes that move, before the script of the page.
std::string_view PageMotionScript();  // page/motion.js
std::string_view PagePlayerScript();  // page/player.js

// The viewer's module (gzip) and its licence; both empty if left out at build time.
std::string_view ViewerProgram();
std::string_view ViewerLicense();
// "SuperSplat Viewer 1.36.2".
std::string_view ViewerName();

}  // namespace color3d
