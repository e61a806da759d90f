// Quality on real scenes: key = a middle training view in its true colour, test = held-out views,
// error = CIEDE2000 between the truth and (true L, predicted ab). Skipped without the shared data;
// ColorizerTest.LearnsTheKeyView needs no data.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/colorizer/personal/train_colorizer.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

constexpr int kSidePx = 256;

struct Picture {
  Image lab;
  Image luminance;
  Image ab;
};

Picture ReadPicture(const fs::path& path) {
  Picture picture;
  picture.lab = LabFromSrgb(FitWithin(ReadImage(path), kSidePx));
  const auto plane = static_cast<std::ptrdiff_t>(picture.lab.PlaneSize());
  picture.luminance = Image(picture.lab.width, picture.lab.height, 1);
  picture.ab = Image(picture.lab.width, picture.lab.height, 2);
  std::copy_n(picture.lab.data.begin(), plane, picture.luminance.data.begin());
  std::copy_n(picture.lab.data.begin() + plane, 2 * plane, picture.ab.data.begin());
  return picture;
}

struct Errors {
  double gray = 0.0;
  double predicted = 0.0;
};

// At most two held-out views (every eighth view).
Errors Measure(const fs::path& folder, int iterations) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<fs::path> training, held_out;
  for (size_t i = 0; i < files.size(); ++i) (i % 8 == 0 ? held_out : training).push_back(files[i]);
  held_out.resize(std::min<size_t>(held_out.size(), 2));
  const Picture key = ReadPicture(training[training.size() / 2]);
  ColorizerOptions options;
  options.iterations = iterations;
  options.max_side_px = kSidePx;
  ThreadPool pool(1);
  NoCheckpoints checkpoints;
  NullObserver progress;
  const auto colorizer = TrainColorizer(Encoder::Embedded(),
                                        {{"key", key.luminance, key.ab}},
                                        options,
                                        {pool, checkpoints, progress, {}});
  Errors errors;
  for (const fs::path& file : held_out) {
    const Picture view = ReadPicture(file);
    const double n = static_cast<double>(held_out.size());
    const Image gray(view.ab.width, view.ab.height, 2);
    errors.gray += MeanDeltaE00(view.lab, JoinLab(view.luminance, gray)) / n;
    errors.predicted +=
        MeanDeltaE00(view.lab, JoinLab(view.luminance, colorizer->Colorize(view.luminance))) / n;
  }
  return errors;
}

TEST(ColorizerQualityTest, ColorsFern) {
  const fs::path folder = fs::path(COLOR3D_SHARED_DATA) / "scenes/fern/images";
  if (!fs::exists(folder)) GTEST_SKIP() << "no shared data";
  const Errors errors = Measure(folder, 0);
  EXPECT_GT(errors.gray, 9.0);
  EXPECT_LT(errors.predicted, 4.5);
}

TEST(ColorizerQualityTest, ColorsFox) {
  const fs::path folder = fs::path(COLOR3D_SHARED_DATA) / "scenes/fox/images";
  if (!fs::exists(folder)) GTEST_SKIP() << "no shared data";
  const Errors errors = Measure(folder, 0);
  EXPECT_GT(errors.gray, 10.0);
  EXPECT_LT(errors.predicted, 9.0);
}

}  // namespace
}  // namespace color3d
