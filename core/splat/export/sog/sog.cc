#include "core/splat/export/sog/sog.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/splat/export/bytes.h"
#include "core/splat/export/morton.h"
#include "core/splat/export/sog/codebook.h"
#include "core/splat/export/sog/lossless_webp.h"
#include "core/splat/model/spherical_harmonics.h"
#include "core/zip/zip.h"

namespace color3d {
namespace {

constexpr int kPaletteColumns = 64;         // of the picture of centroids
constexpr int kGaussiansPerPaletteRow = 8;  // at least: more rows cost about what they save
constexpr int kMaxPalette = 65536;
// Fewer levels than 256 make smaller pictures with hardly visible loss, except for scales.
constexpr int kColorLevels = 128;
constexpr int kHarmonicLevels = 64;
constexpr int kLargestIsW = 252;  // the fourth byte of a rotation: which component is left out

// Six digits in JSON, more than the precision of a codebook's levels.
std::vector<double> ShortNumbers(const Codebook& codebook) {
  std::vector<double> numbers;
  for (const float level : codebook.levels()) {
    numbers.push_back(std::stod(fmt::format("{:.6g}", level)));
  }
  return numbers;
}

// The largest component is omitted and positive; the others span -1/sqrt(2)..1/sqrt(2).
std::array<uint8_t, 4> PackRotation(const float* q) {
  int largest = 0;
  for (int k = 1; k < 4; ++k) {
    if (std::abs(q[k]) > std::abs(q[largest])) largest = k;
  }
  const float factor = std::copysign(static_cast<float>(M_SQRT1_2), q[largest]);
  std::array<uint8_t, 4> packed;
  int next = 0;
  for (int k = 0; k < 4; ++k) {
    if (k != largest) packed[next++] = Byte(255.0f * (0.5f + factor * q[k]));
  }
  packed[3] = static_cast<uint8_t>(kLargestIsW + largest);
  return packed;
}

class SogWriter {
 public:
  SogWriter(const ViewerGaussians& gaussians, ThreadPool& pool)
      : g_(gaussians),
        pool_(pool),
        count_(gaussians.size()),
        coefficients_(static_cast<size_t>(ShCoefficients(gaussians.sh_degree))),
        grid_(LogGridOf(gaussians.position)),
        order_(MortonOrder(grid_)) {
    // Multiples of 4; at least one pixel.
    const double side = std::sqrt(static_cast<double>(std::max<size_t>(count_, 1)));
    width_ = 4 * static_cast<int>(std::ceil(side / 4.0));
    const size_t rows = (count_ + width_ - 1) / width_;
    height_ = 4 * static_cast<int>((std::max<size_t>(rows, 1) + 3) / 4);
  }

  std::string Write() {
    meta_["version"] = 2;
    meta_["asset"] = {{"generator", "Color3D"}};
    meta_["count"] = count_;
    Means();
    Scales();
    Rotations();
    BaseColors();
    if (coefficients_ > 1 && count_ > 0) Harmonics();
    std::vector<ZipEntry> entries(textures_.size() + 1);
    entries[0] = {"meta.json", meta_.dump()};
    pool_.ForEach(static_cast<int64_t>(textures_.size()), [&](int64_t i, int) {
      entries[i + 1] = {textures_[i].first, EncodeLosslessWebp(textures_[i].second)};
    });
    return StoredZip(entries);
  }

 private:
  // pixel(i, out) fills the 4 bytes of Gaussian i.
  template <typename Pixel>
  void AddTexture(const char* name, const Pixel& pixel) {
    RgbaTexture texture{
        width_, height_, std::vector<uint8_t>(4 * static_cast<size_t>(width_) * height_, 0)};
    for (size_t at = 0; at < count_; ++at) pixel(order_[at], texture.rgba.data() + 4 * at);
    textures_.emplace_back(name, std::move(texture));
  }

  void Means() {
    meta_["means"] = {
        {"mins", grid_.low}, {"maxs", grid_.high}, {"files", {"means_l.webp", "means_u.webp"}}};
    for (const unsigned shift : {0u, 8u}) {
      AddTexture(shift == 0 ? "means_l.webp" : "means_u.webp", [&](size_t i, uint8_t* out) {
        for (int k = 0; k < 3; ++k) {
          out[k] = static_cast<uint8_t>(grid_.cell[3 * i + k] >> shift);
        }
        out[3] = 255;
      });
    }
  }

  void Scales() {
    const Codebook codebook(g_.log_scale);
    meta_["scales"] = {{"codebook", ShortNumbers(codebook)}, {"files", {"scales.webp"}}};
    AddTexture("scales.webp", [&](size_t i, uint8_t* out) {
      for (int k = 0; k < 3; ++k) out[k] = codebook.Nearest(g_.log_scale[3 * i + k]);
      out[3] = 255;
    });
  }

  void Rotations() {
    meta_["quats"] = {{"files", {"quats.webp"}}};
    AddTexture("quats.webp", [&](size_t i, uint8_t* out) {
      const std::array<uint8_t, 4> packed = PackRotation(g_.rotation.data() + 4 * i);
      std::copy(packed.begin(), packed.end(), out);
    });
  }

  const float* Sh(size_t i) const { return g_.sh.data() + i * coefficients_ * 3; }

  void BaseColors() {
    std::vector<float> values;
    values.reserve(3 * count_);
    for (size_t i = 0; i < count_; ++i) values.insert(values.end(), Sh(i), Sh(i) + 3);
    const Codebook codebook(std::move(values), kColorLevels);
    meta_["sh0"] = {{"codebook", ShortNumbers(codebook)}, {"files", {"sh0.webp"}}};
    AddTexture("sh0.webp", [&](size_t i, uint8_t* out) {
      for (int c = 0; c < 3; ++c) out[c] = codebook.Nearest(Sh(i)[c]);
      out[3] = Byte(255.0f * (1.0f / (1.0f + std::exp(-g_.opacity_logit[i]))));
    });
  }

  // A palette of rows (all coefficients above degree 0), and for each Gaussian its row's number.
  void Harmonics() {
    const size_t rest = coefficients_ - 1;
    std::vector<float> rows;
    rows.reserve(count_ * rest * 3);
    // In the file's order, so that the initial rows of clusters are spread over space.
    for (const uint32_t i : order_) rows.insert(rows.end(), Sh(i) + 3, Sh(i) + 3 * coefficients_);
    const size_t wanted = std::clamp<size_t>(count_ / kGaussiansPerPaletteRow, 1, kMaxPalette);
    const int size = static_cast<int>(std::bit_floor(wanted));
    const Palette palette = MakePalette(rows, static_cast<int>(3 * rest), size, pool_);
    const Codebook codebook(palette.rows, kHarmonicLevels);

    RgbaTexture centroids;
    centroids.width = kPaletteColumns * static_cast<int>(rest);
    centroids.height = (size + kPaletteColumns - 1) / kPaletteColumns;
    centroids.rgba.assign(4 * static_cast<size_t>(centroids.width) * centroids.height, 0);
    for (size_t at = 0; at < static_cast<size_t>(size) * rest; ++at) {
      for (int c = 0; c < 3; ++c) {
        centroids.rgba[4 * at + c] = codebook.Nearest(palette.rows[3 * at + c]);
      }
      centroids.rgba[4 * at + 3] = 255;
    }
    std::vector<uint16_t> label(count_);
    for (size_t at = 0; at < count_; ++at) label[order_[at]] = palette.labels[at];
    meta_["shN"] = {{"count", size},
                    {"bands", g_.sh_degree},
                    {"codebook", ShortNumbers(codebook)},
                    {"files", {"shN_centroids.webp", "shN_labels.webp"}}};
    textures_.emplace_back("shN_centroids.webp", std::move(centroids));
    AddTexture("shN_labels.webp", [&](size_t i, uint8_t* out) {
      out[0] = static_cast<uint8_t>(label[i] & 0xff);
      out[1] = static_cast<uint8_t>(label[i] >> 8u);
      out[2] = 0;
      out[3] = 255;
    });
  }

  const ViewerGaussians& g_;
  ThreadPool& pool_;
  size_t count_;
  size_t coefficients_;
  LogGrid grid_;
  std::vector<uint32_t> order_;
  int width_ = 0;
  int height_ = 0;
  nlohmann::ordered_json meta_;
  std::vector<std::pair<const char*, RgbaTexture>> textures_;
};

}  // namespace

std::vector<uint32_t> SogOrder(const std::vector<float>& position) {
  return MortonOrder(LogGridOf(position));
}

std::string EncodeSog(const ViewerGaussians& gaussians, ThreadPool& pool) {
  CheckFinite(gaussians);
  return SogWriter(gaussians, pool).Write();
}

}  // namespace color3d
