#include "tests/bench/pretrain/photo_set.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/image/probe/probe.h"

namespace color3d {
namespace {

constexpr double kMinArea = 0.3;        // of the photo, in a crop
constexpr double kMaxAspect = 4.0 / 3;  // of a crop before it is made square

// What separates a film scan from the grey of a modern photo: tone curve, softness, grain.
void Degrade(Image& luminance, Random& random) {
  const double gamma = std::exp(random.NextUniform(-0.3, 0.3));
  const double gain = random.NextUniform(0.85, 1.05);
  const double offset = random.NextUniform(0.0, 6.0);
  const bool soft = random.NextUniform() < 0.2;
  const double grain = random.NextUniform() < 0.3 ? random.NextUniform(0.5, 4.0) : 0.0;
  if (soft) {
    const int size = luminance.width;
    luminance = Resize(Resize(luminance, size / 2, size / 2), size, size);
  }
  for (float& v : luminance.data) {
    double value = 100.0 * std::pow(std::clamp(v / 100.0, 0.0, 1.0), gamma) * gain + offset;
    if (grain > 0.0) value += grain * (random.NextUniform() + random.NextUniform() - 1.0) * 2.4;
    v = static_cast<float>(std::clamp(value, 0.0, 100.0));
  }
}

}  // namespace

PhotoSet::PhotoSet(const std::vector<PhotoFolder>& folders) {
  std::vector<double> shares;
  for (const PhotoFolder& folder : folders) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder.path)) {
      if (entry.is_regular_file() && HasImageExtension(entry.path().string())) {
        files.push_back(entry.path());
      }
    }
    std::sort(files.begin(), files.end());
    const size_t before = photos_.size();
    for (const std::filesystem::path& file : files) {
      const Image image = ReadImage(file);
      if (image.channels != 3 || IsGray(image)) continue;
      Photo photo{image.width, image.height, {}};
      photo.data.reserve(image.data.size());
      for (float v : image.data)
        photo.data.push_back(static_cast<uint8_t>(std::lround(255.0f * v)));
      photos_.push_back(std::move(photo));
    }
    const size_t count = photos_.size() - before;
    if (count == 0) throw InvalidArgument("{} holds no colour photographs", folder.path.string());
    shares.insert(shares.end(), count, folder.weight / static_cast<double>(count));
  }
  double sum = 0.0;
  for (double share : shares) upper_.push_back(sum += share);
}

TrainingCrop PhotoSet::Crop(int size_px, Random& random) const {
  const double pick = random.NextUniform() * upper_.back();
  const size_t index = std::upper_bound(upper_.begin(), upper_.end() - 1, pick) - upper_.begin();
  const Photo& photo = photos_[index];
  const double area = random.NextUniform(kMinArea, 1.0) * photo.width * photo.height;
  const double aspect = std::exp(random.NextUniform(-1.0, 1.0) * std::log(kMaxAspect));
  const int width = std::clamp(static_cast<int>(std::sqrt(area * aspect)), 8, photo.width);
  const int height = std::clamp(static_cast<int>(std::sqrt(area / aspect)), 8, photo.height);
  const int x0 = static_cast<int>(random.NextBelow(photo.width - width + 1));
  const int y0 = static_cast<int>(random.NextBelow(photo.height - height + 1));
  const bool mirror = random.NextUniform() < 0.5;
  Image crop(width, height, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < height; ++y) {
      const uint8_t* row =
          &photo.data[(static_cast<size_t>(c) * photo.height + y0 + y) * photo.width + x0];
      float* out = crop.Plane(c) + static_cast<size_t>(y) * width;
      for (int x = 0; x < width; ++x) out[x] = row[mirror ? width - 1 - x : x] / 255.0f;
    }
  }
  TrainingCrop result;
  result.srgb = Resize(crop, size_px, size_px);
  const Image lab = LabFromSrgb(result.srgb);
  result.luminance = LuminanceOfLab(lab);
  result.ab = ChromaOfLab(lab);
  Degrade(result.luminance, random);
  return result;
}

}  // namespace color3d
