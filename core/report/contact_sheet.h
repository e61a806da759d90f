// Contact sheet of ranked views: thumbnails in order, the chosen one framed, those set aside in
// grey with the reason. Pure functions.
#pragma once

#include <string>
#include <vector>

#include "core/base/image.h"

namespace color3d {

struct SheetView {
  Image thumbnail;   // 1 or 3 channels, 0..1, any size
  std::string name;  // of the view
  std::string note;  // below the name: the score, or the reason for setting it aside
  bool chosen = false;
};

struct ContactSheet {
  std::string title;
  std::string subtitle;
  std::vector<SheetView> ranked;  // best first
  int ranked_left_out = 0;        // number of further ranked views
  std::vector<SheetView> set_aside;
  int set_aside_left_out = 0;
};

// Returns 3 channels, sRGB, 1600 px wide. Throws Error{kInvalidArgument} if no view is ranked.
Image DrawContactSheet(const ContactSheet& sheet);

}  // namespace color3d
