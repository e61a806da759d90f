// The ranking of the views as one picture: thumbnails in order, the chosen one framed, those that
// were set aside greyed with the reason. Pure functions.
#pragma once

#include <string>
#include <vector>

#include "core/base/image.h"

namespace color3d {

struct SheetView {
  Image thumbnail;   // 1 or 3 channels, 0..1, any size
  std::string name;  // of the view
  std::string note;  // below the name: the score, or why it was set aside
  bool chosen = false;
};

struct ContactSheet {
  std::string title;
  std::string subtitle;
  std::vector<SheetView> ranked;  // best first
  int ranked_left_out = 0;        // how many more take part
  std::vector<SheetView> set_aside;
  int set_aside_left_out = 0;
};

// 3 channels, sRGB, 1600 px wide. Throws Error{kInvalidArgument} when no view is ranked.
Image DrawContactSheet(const ContactSheet& sheet);

}  // namespace color3d
