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

constexpr WindowOptions kAlone;  // for single crops
// For pairs, whose colours are copied from the first crop.
constexpr WindowOptions kFirst = {.min_area = 0.3, .max_turn = 0.15};
constexpr WindowOptions kSecond = {.min_area = 0.15, .max_aspect = 1.6, .max_turn = 0.25};
constexpr double kMirroredPairs = 0.15;
constexpr int64_t kMaxFramesApart = 20;
constexpr int kCellPx = 4;

// Degrades a digital photo to a scan of film: tone curve, blur, grain.
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

TrainingCrop CropOf(const BytePhoto& photo, const CropWindow& window, int size_px, Random& random) {
  TrainingCrop crop;
  crop.srgb = SampleWindow(photo, window, size_px);
  const Image lab = LabFromSrgb(crop.srgb);
  crop.luminance = LuminanceOfLab(lab);
  crop.ab = ChromaOfLab(lab);
  Degrade(crop.luminance, random);
  return crop;
}

std::vector<std::filesystem::path> PicturesBelow(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && HasImageExtension(entry.path().string())) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Positions of the cells of `second` in `first`, both windows of one photo.
Image Matches(const CropWindow& first, const CropWindow& second, int size_px) {
  const int cells = size_px / kCellPx;
  Image matches(cells, cells, 2, -1.0f);
  for (int i = 0; i < cells; ++i) {
    for (int j = 0; j < cells; ++j) {
      const auto uv = first.Inverse(second.At((j + 0.5) / cells, (i + 0.5) / cells));
      if (std::min(uv[0], uv[1]) < 0.0 || std::max(uv[0], uv[1]) >= 1.0) continue;
      matches.At(0, i, j) = static_cast<float>(uv[0] * size_px);
      matches.At(1, i, j) = static_cast<float>(uv[1] * size_px);
    }
  }
  return matches;
}

}  // namespace

PhotoSet::PhotoSet(const std::vector<PhotoFolder>& folders, const std::vector<PhotoFolder>& clips) {
  std::vector<double> shares;
  const auto add = [&](const PhotoFolder& folder, bool of_clips) {
    const size_t count = AddFolder(folder.path, of_clips);
    shares.insert(shares.end(), count, folder.weight / static_cast<double>(count));
  };
  for (const PhotoFolder& folder : folders) add(folder, false);
  for (const PhotoFolder& folder : clips) add(folder, true);
  double sum = 0.0;
  for (double share : shares) upper_.push_back(sum += share);
}

size_t PhotoSet::AddFolder(const std::filesystem::path& folder, bool clips) {
  const size_t before = groups_.size();
  std::filesystem::path clip;
  for (const std::filesystem::path& file : PicturesBelow(folder)) {
    const Image image = ReadImage(file);
    if (image.channels != 3 || IsGray(image)) continue;
    BytePhoto photo{image.width, image.height, {}};
    photo.data.reserve(image.data.size());
    for (float v : image.data) photo.data.push_back(static_cast<uint8_t>(std::lround(255.0f * v)));
    photos_.push_back(std::move(photo));
    if (clips && groups_.size() > before && file.parent_path() == clip) {
      ++groups_.back().count;
    } else {
      groups_.push_back({photos_.size() - 1, 1});
      clip = file.parent_path();
    }
  }
  if (groups_.size() == before) {
    throw InvalidArgument("{} holds no colour photographs", folder.string());
  }
  return groups_.size() - before;
}

const PhotoSet::Group& PhotoSet::PickGroup(Random& random) const {
  const double pick = random.NextUniform() * upper_.back();
  return groups_[std::upper_bound(upper_.begin(), upper_.end() - 1, pick) - upper_.begin()];
}

TrainingCrop PhotoSet::Crop(int size_px, Random& random) const {
  const Group& group = PickGroup(random);
  const BytePhoto& photo =
      photos_[group.first + random.NextBelow(static_cast<uint32_t>(group.count))];
  return CropOf(photo, RandomWindow(photo, kAlone, random), size_px, random);
}

TrainingPair PhotoSet::Pair(int size_px, Random& random) const {
  const Group& group = PickGroup(random);
  const auto count = static_cast<int64_t>(group.count);
  const int64_t one = random.NextBelow(static_cast<uint32_t>(count));
  const int64_t from = std::max<int64_t>(0, one - kMaxFramesApart);
  const int64_t to = std::min(count - 1, one + kMaxFramesApart);
  const int64_t other = from + random.NextBelow(static_cast<uint32_t>(to - from + 1));
  const BytePhoto& first = photos_[group.first + one];
  const BytePhoto& second = photos_[group.first + other];
  const CropWindow first_window = RandomWindow(first, kFirst, random);
  WindowOptions options = kSecond;
  options.mirror_probability = first_window.Mirrored() ? 1.0 - kMirroredPairs : kMirroredPairs;
  const CropWindow second_window = RandomWindow(second, options, random);
  TrainingPair pair;
  pair.first = CropOf(first, first_window, size_px, random);
  pair.second = CropOf(second, second_window, size_px, random);
  const int cells = size_px / kCellPx;
  pair.matches =
      one == other ? Matches(first_window, second_window, size_px) : Image(cells, cells, 2, -1.0f);
  return pair;
}

}  // namespace color3d
