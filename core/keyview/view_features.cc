#include "core/keyview/view_features.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/base/error.h"
#include "core/base/random.h"

namespace color3d {
namespace {

constexpr uint32_t kMagic = 0x32465643;  // "CVF2"
constexpr uint32_t kMaxLength = 1u << 24;

// The first `wanted` cells of the R2 sequence (Roberts 2018, "The unreasonable effectiveness of
// quasirandom sequences") with a random start, each cell once.
std::vector<int> SpreadCells(int width, int height, int wanted, uint64_t seed) {
  constexpr double kStepX = 0.7548776662466927;
  constexpr double kStepY = 0.5698402909980532;
  Random random(seed, /*stream=*/0x63656c6c);
  double u = random.NextUniform();
  double v = random.NextUniform();
  std::vector<bool> taken(static_cast<size_t>(width) * height, false);
  std::vector<int> cells;
  for (int tries = 8 * wanted; tries > 0 && static_cast<int>(cells.size()) < wanted; --tries) {
    const int cell = static_cast<int>(v * height) * width + static_cast<int>(u * width);
    if (!taken[cell]) cells.push_back(cell);
    taken[cell] = true;
    u = std::fmod(u + kStepX, 1.0);
    v = std::fmod(v + kStepY, 1.0);
  }
  for (size_t cell = 0; cell < taken.size() && static_cast<int>(cells.size()) < wanted; ++cell) {
    if (!taken[cell]) cells.push_back(static_cast<int>(cell));
  }
  return cells;
}

uint16_t HalfBits(float value) {
  constexpr float kLargest = 65504.0f;
  const float finite = std::isfinite(value) ? std::clamp(value, -kLargest, kLargest) : 0.0f;
  return Eigen::half_impl::float_to_half_rtne(finite).x;
}

template <typename T>
void Append(const T* values, size_t count, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

// Returns false if fewer bytes remain.
template <typename T>
bool Take(std::string_view* bytes, size_t count, T* values) {
  if (bytes->size() < count * sizeof(T)) return false;
  std::memcpy(values, bytes->data(), count * sizeof(T));
  bytes->remove_prefix(count * sizeof(T));
  return true;
}

}  // namespace

void ViewFeatures::KeepCells(int count) {
  if (count >= Cells()) return;
  deep.resize(static_cast<size_t>(count) * channels);
  deep.shrink_to_fit();
}

ViewFeatures PackViewFeatures(std::vector<double> descriptor,
                              const FrameContent& content,
                              const Image& deep,
                              uint64_t seed) {
  if (deep.Empty()) throw InvalidArgument("a view has no deep features: the grid is empty");
  ViewFeatures features{std::move(descriptor), content, deep.channels, {}, {}};
  const int wanted =
      std::min<int>(static_cast<int>(deep.PlaneSize()), static_cast<int>(ViewFeatures::kMaxCells));
  features.deep.reserve(static_cast<size_t>(wanted) * deep.channels);
  for (int cell : SpreadCells(deep.width, deep.height, wanted, seed)) {
    for (int c = 0; c < deep.channels; ++c) {
      features.deep.push_back(HalfBits(deep.Plane(c)[cell]));
    }
  }
  return features;
}

std::string SerializeViewFeatures(const ViewFeatures& features) {
  const uint32_t header[] = {kMagic,
                             static_cast<uint32_t>(features.descriptor.size()),
                             static_cast<uint32_t>(features.channels),
                             static_cast<uint32_t>(features.deep.size()),
                             static_cast<uint32_t>(features.thumbnail.size())};
  std::string bytes;
  Append(header, std::size(header), &bytes);
  Append(&features.content, 1, &bytes);
  Append(features.descriptor.data(), features.descriptor.size(), &bytes);
  Append(features.deep.data(), features.deep.size(), &bytes);
  return bytes + features.thumbnail;
}

std::optional<ViewFeatures> ParseViewFeatures(std::string_view bytes) {
  uint32_t header[5];
  ViewFeatures features;
  if (!Take(&bytes, 5, header) || header[0] != kMagic || !Take(&bytes, 1, &features.content)) {
    return std::nullopt;
  }
  if (header[1] > kMaxLength || header[3] > kMaxLength || header[4] > kMaxLength ||
      header[2] == 0 || header[3] % header[2] != 0 ||
      bytes.size() != header[1] * sizeof(double) + header[3] * sizeof(uint16_t) + header[4]) {
    return std::nullopt;
  }
  features.descriptor.resize(header[1]);
  features.channels = static_cast<int>(header[2]);
  features.deep.resize(header[3]);
  Take(&bytes, features.descriptor.size(), features.descriptor.data());
  Take(&bytes, features.deep.size(), features.deep.data());
  features.thumbnail = bytes;
  return features;
}

}  // namespace color3d
