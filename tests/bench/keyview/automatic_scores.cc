#include "tests/bench/keyview/automatic_scores.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/image/probe/probe.h"

namespace color3d {
namespace {

Image SideBySide(const std::vector<Image>& images) {
  constexpr int kGapPx = 4;
  const int width = images[0].width;
  const int height = images[0].height;
  const int count = static_cast<int>(images.size());
  Image sheet(count * (width + kGapPx) - kGapPx, height, 3, 1.0f);
  for (int i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) {
      for (int y = 0; y < height; ++y) {
        std::copy_n(images[i].Plane(c) + static_cast<size_t>(y) * width,
                    width,
                    sheet.Plane(c) + static_cast<size_t>(y) * sheet.width + i * (width + kGapPx));
      }
    }
  }
  return sheet;
}

}  // namespace

std::vector<std::filesystem::path> PhotosBelow(const std::filesystem::path& folder, int count) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && HasImageExtension(entry.path().string())) {
      files.push_back(entry.path());
    }
  }
  if (files.empty()) throw InvalidArgument("{} has no photographs", folder.string());
  std::sort(files.begin(), files.end());
  const size_t wanted = static_cast<size_t>(count);
  if (count <= 0 || wanted >= files.size()) return files;
  std::vector<std::filesystem::path> some;
  for (size_t i = 0; i < wanted; ++i) some.push_back(files[i * files.size() / wanted]);
  return some;
}

AutomaticScore ScoreAutomatic(const AutomaticColorizer& colorizer,
                              const std::filesystem::path& photo,
                              int max_side_px,
                              const std::filesystem::path& out_folder) {
  const Image truth = LabFromSrgb(FitWithin(ReadImage(photo), max_side_px));
  const Image luminance = LuminanceOfLab(truth);
  const Image grey = JoinLab(luminance, Image(truth.width, truth.height, 2));
  const Image predicted = JoinLab(luminance, colorizer.Colorize(luminance).ab);
  const Image srgb = SrgbFromLab(predicted);
  const Image true_srgb = SrgbFromLab(truth);
  if (!out_folder.empty()) {
    std::filesystem::create_directories(out_folder);
    WriteFileAtomic(out_folder / (photo.stem().string() + ".png"),
                    EncodePng8(SideBySide({SrgbFromLab(grey), srgb, true_srgb})));
  }
  return {photo.filename().string(),
          MeanDeltaE00(predicted, truth),
          MeanDeltaE00(grey, truth),
          Colorfulness(srgb),
          Colorfulness(true_srgb)};
}

AutomaticScore MeanScore(const std::vector<AutomaticScore>& scores) {
  AutomaticScore mean;
  mean.photo = "mean";
  const double n = static_cast<double>(scores.size());
  for (const AutomaticScore& score : scores) {
    mean.delta_e00 += score.delta_e00 / n;
    mean.delta_e00_gray += score.delta_e00_gray / n;
    mean.colorfulness += score.colorfulness / n;
    mean.true_colorfulness += score.true_colorfulness / n;
  }
  return mean;
}

}  // namespace color3d
