#include <webp/decode.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/splat/import/read_support.h"
#include "core/zip/zip.h"

namespace color3d {
namespace {

using nlohmann::json;

constexpr uint64_t kMaxMetaBytes = 16 << 20;
// A picture has a pixel for each Gaussian and padding to full rows.
constexpr uint64_t kSparePixels = 1 << 20;
constexpr size_t kPaletteRow = 64;  // entries of the palette of harmonics in one row of its picture
constexpr size_t kMaxPalette = 65'536;
constexpr int kFirstLargest = 252;  // marks which component of a rotation was left out

struct Pixels {
  size_t width = 0;
  std::vector<uint8_t> rgba;
  size_t count() const { return rgba.size() / 4; }
  const uint8_t* At(size_t i) const { return rgba.data() + 4 * i; }
};

class SogReader {
 public:
  SogReader(std::string_view bytes, const SplatSource& source)
      : source_(source), archive_(bytes, source.name), zip_(archive_) {
    if (!zip_.Find("meta.json")) {
      throw InvalidArgument("{} is a zip without meta.json, not a SOG; give a .sog or a 3DGS .ply",
                            source.name);
    }
    meta_ = json::parse(zip_.Read("meta.json", kMaxMetaBytes), nullptr, /*allow_exceptions=*/false);
    if (!meta_.is_object())
      throw InvalidArgument("meta.json of {} is not valid JSON; copy the file again", source.name);
  }

  ViewerGaussians Read() {
    try {
      CheckVersion();
      const auto count = meta_.at("count").get<int64_t>();
      if (count < 0) throw InvalidArgument("{} claims to have {} Gaussians", source_.name, count);
      CheckCount(static_cast<uint64_t>(count), source_);
      return ReadAll(static_cast<size_t>(count));
    } catch (const json::exception& e) {
      // Shortened to one line.
      throw InvalidArgument("meta.json of {} does not follow SOG version 2 ({})",
                            source_.name,
                            std::string(e.what()).substr(0, 120));
    }
  }

 private:
  void CheckVersion() const {
    const json version = meta_.value("version", json(1));
    if (version == 2) return;
    throw InvalidArgument(
        "{} is SOG of version {}, but only version 2 can be read; convert it with a newer tool "
        "(splat-transform in.sog out.ply)",
        source_.name,
        version.is_number() ? version.dump() : "unknown");
  }

  Pixels Picture(const char* part, int index, size_t least_pixels, uint64_t most_pixels) const {
    const std::string file = meta_.at(part).at("files").at(index).get<std::string>();
    const std::string bytes = zip_.Read(file, 4 * most_pixels + kSparePixels);
    const auto* data = reinterpret_cast<const uint8_t*>(bytes.data());
    int width = 0, height = 0;
    if (WebPGetInfo(data, bytes.size(), &width, &height) == 0 || width < 1 || height < 1) {
      throw InvalidArgument("{} of {} is not a WebP picture", file, source_.name);
    }
    const uint64_t pixels = static_cast<uint64_t>(width) * static_cast<uint64_t>(height);
    if (pixels < least_pixels || pixels > most_pixels) {
      throw InvalidArgument("{} of {} has {} x {} px where {} values are needed",
                            file,
                            source_.name,
                            width,
                            height,
                            least_pixels);
    }
    Pixels result;
    result.width = static_cast<size_t>(width);
    result.rgba.resize(4 * pixels);
    if (WebPDecodeRGBAInto(data, bytes.size(), result.rgba.data(), result.rgba.size(), 4 * width) ==
        nullptr) {
      throw InvalidArgument(
          "{} of {} is truncated or damaged; copy the file again", file, source_.name);
    }
    return result;
  }
  Pixels Picture(const char* part, int index, size_t count) const {
    return Picture(part, index, count, 2 * static_cast<uint64_t>(count) + kSparePixels);
  }

  // 256 levels, finite.
  std::vector<float> Levels(const char* part) const {
    auto levels = meta_.at(part).at("codebook").get<std::vector<float>>();
    levels.resize(256, 0.0f);
    for (const float level : levels) {
      if (!std::isfinite(level)) {
        throw InvalidArgument("the codebook of {} in {} is not finite", part, source_.name);
      }
    }
    return levels;
  }

  std::vector<double> Bounds(const char* name) const {
    const auto bounds = meta_.at("means").at(name).get<std::vector<double>>();
    if (bounds.size() != 3) {
      throw InvalidArgument(
          "means.{} of {} has {} numbers, not 3", name, source_.name, bounds.size());
    }
    return bounds;
  }

  ViewerGaussians ReadAll(size_t count) const {
    const int degree = meta_.contains("shN") ? meta_.at("shN").at("bands").get<int>() : 0;
    if (degree < 0 || degree > 3) {
      throw InvalidArgument(
          "{} has harmonics of degree {}; up to 3 can be read", source_.name, degree);
    }
    ViewerGaussians g = EmptyGaussians(count, degree);
    if (count == 0) return g;
    ReadPositions(&g);
    ReadShapes(&g);
    if (degree > 0) ReadHarmonics(&g);
    return g;
  }

  void ReadPositions(ViewerGaussians* g) const {
    const std::vector<double> low = Bounds("mins"), high = Bounds("maxs");
    const Pixels lower = Picture("means", 0, g->size()), upper = Picture("means", 1, g->size());
    for (size_t i = 0; i < g->size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        const double unit = (256 * upper.At(i)[k] + lower.At(i)[k]) / 65535.0;
        const double log = low[k] + unit * (high[k] - low[k]);
        g->position[3 * i + k] = static_cast<float>(std::copysign(std::expm1(std::abs(log)), log));
      }
    }
  }

  void ReadShapes(ViewerGaussians* g) const {
    const std::vector<float> scale_levels = Levels("scales"), color_levels = Levels("sh0");
    const Pixels scales = Picture("scales", 0, g->size());
    const Pixels rotations = Picture("quats", 0, g->size());
    const Pixels colors = Picture("sh0", 0, g->size());
    const size_t row = 3 * static_cast<size_t>(ShCoefficients(g->sh_degree));
    for (size_t i = 0; i < g->size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        g->log_scale[3 * i + k] = scale_levels[scales.At(i)[k]];
        g->sh[i * row + k] = color_levels[colors.At(i)[k]];
      }
      g->opacity_logit[i] = LogitOf(static_cast<float>(colors.At(i)[3]) / 255.0f);
      const int largest = rotations.At(i)[3] - kFirstLargest;
      if (largest < 0) {
        throw InvalidArgument("the rotations of {} are damaged; copy the file again", source_.name);
      }
      float left = 1.0f;
      for (int k = 0, next = 0; k < 4; ++k) {
        if (k == largest) continue;
        const float unit = static_cast<float>(rotations.At(i)[next++]) / 255.0f;
        const float q = (unit * 2.0f - 1.0f) / std::sqrt(2.0f);
        g->rotation[4 * i + k] = q;
        left -= q * q;
      }
      g->rotation[4 * i + largest] = std::sqrt(std::max(left, 0.0f));
    }
  }

  void ReadHarmonics(ViewerGaussians* g) const {
    const size_t rest = static_cast<size_t>(ShCoefficients(g->sh_degree)) - 1;
    const auto palette = meta_.at("shN").at("count").get<size_t>();
    if (palette < 1 || palette > kMaxPalette) {
      throw InvalidArgument("{} has a palette of {} harmonics; 1 to {} are possible",
                            source_.name,
                            palette,
                            kMaxPalette);
    }
    const size_t rows = (palette + kPaletteRow - 1) / kPaletteRow;
    const size_t pixels = kPaletteRow * rest * rows;
    const Pixels centroids = Picture("shN", 0, pixels, kPaletteRow * rest * (rows + kPaletteRow));
    if (centroids.width != kPaletteRow * rest) {
      throw InvalidArgument("the palette of {} is {} px wide, not {}",
                            source_.name,
                            centroids.width,
                            kPaletteRow * rest);
    }
    const Pixels labels = Picture("shN", 1, g->size());
    const std::vector<float> levels = Levels("shN");
    for (size_t i = 0; i < g->size(); ++i) {
      const size_t label = labels.At(i)[0] + size_t{256} * labels.At(i)[1];
      if (label >= palette) {
        throw InvalidArgument("{} refers to harmonics outside its palette; copy the file again",
                              source_.name);
      }
      const size_t first = label / kPaletteRow * centroids.width + label % kPaletteRow * rest;
      for (size_t j = 0; j < rest; ++j) {
        for (int c = 0; c < 3; ++c) {
          g->sh[(i * (rest + 1) + j + 1) * 3 + c] = levels[centroids.At(first + j)[c]];
        }
      }
    }
  }

  const SplatSource& source_;
  MemorySource archive_;
  ZipReader zip_;
  json meta_;
};

}  // namespace

ViewerGaussians ReadSog(std::string_view bytes, const SplatSource& source) {
  return SogReader(bytes, source).Read();
}

}  // namespace color3d
