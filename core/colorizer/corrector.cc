#include "core/colorizer/corrector.h"

#include <cstring>

namespace color3d {
namespace {

constexpr size_t kPositionValues = 4;  // of each cell

void Append(const std::vector<float>& values, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
}

}  // namespace

// The number of cells, their positions, their features.
std::string SerializePictureCells(const PictureCells& cells) {
  const auto count = static_cast<uint32_t>(cells.positions.size() / kPositionValues);
  std::string bytes(reinterpret_cast<const char*>(&count), sizeof(count));
  Append(cells.positions, &bytes);
  Append(cells.features, &bytes);
  return bytes;
}

std::optional<PictureCells> ParsePictureCells(std::string_view bytes) {
  uint32_t count = 0;
  if (bytes.size() < sizeof(count)) return std::nullopt;
  std::memcpy(&count, bytes.data(), sizeof(count));
  bytes.remove_prefix(sizeof(count));
  const size_t values = bytes.size() / sizeof(float), positions = kPositionValues * size_t{count};
  if (count == 0 || bytes.size() % sizeof(float) != 0 || values <= positions ||
      (values - positions) % count != 0) {
    return std::nullopt;
  }
  PictureCells cells{std::vector<float>(values - positions), std::vector<float>(positions)};
  std::memcpy(cells.positions.data(), bytes.data(), positions * sizeof(float));
  std::memcpy(cells.features.data(),
              bytes.data() + positions * sizeof(float),
              (values - positions) * sizeof(float));
  return cells;
}

}  // namespace color3d
