// Accuracy of automatic colourizers on photographs of known colours.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/keycolor/automatic/automatic.h"

namespace color3d {

struct AutomaticScore {
  std::string photo;
  double delta_e00 = 0.0;  // mean CIEDE2000 to the true colours, at the true L
  double delta_e00_gray = 0.0;
  double colorfulness = 0.0;
  double true_colorfulness = 0.0;
};

// Returns photographs below a folder, sorted, at most `count` evenly spaced ones (0: all). Throws
// Error{kInvalidArgument} if there are none.
std::vector<std::filesystem::path> PhotosBelow(const std::filesystem::path& folder, int count);

// Colours the photo's L at `max_side_px`. If a folder is given, writes L, prediction and truth side
// by side as PNG.
AutomaticScore ScoreAutomatic(const AutomaticColorizer& colorizer,
                              const std::filesystem::path& photo,
                              int max_side_px,
                              const std::filesystem::path& out_folder = {});

AutomaticScore MeanScore(const std::vector<AutomaticScore>& scores);

}  // namespace color3d
