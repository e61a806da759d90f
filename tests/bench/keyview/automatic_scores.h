// How well an automatic colourizer does on photographs whose colours are known.
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

// Photographs below a folder, sorted; at most `count` of them, evenly thinned out (0: all). Throws
// Error{kInvalidArgument} when there is none.
std::vector<std::filesystem::path> PhotosBelow(const std::filesystem::path& folder, int count);

// Colours the photo's L at `max_side_px`. With a folder, writes L, prediction and truth side by
// side there as PNG.
AutomaticScore ScoreAutomatic(const AutomaticColorizer& colorizer,
                              const std::filesystem::path& photo,
                              int max_side_px,
                              const std::filesystem::path& out_folder = {});

AutomaticScore MeanScore(const std::vector<AutomaticScore>& scores);

}  // namespace color3d
