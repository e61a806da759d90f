#include "core/augment/augment.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/augment/elastic_field.h"
#include "core/augment/elastic_noise.h"
#include "core/base/error.h"

namespace color3d {
namespace {

using Point = PlanePoint;

// Maximum relative change of scale by the perspective map at the middle of an edge, and maximum
// rotation.
constexpr double kMaxForeshortening = 0.12;
constexpr double kMaxTilt = 6.0 * std::numbers::pi / 180.0;

void Check(const Image& luminance, const Image& ab, const AugmentOptions& options) {
  if (luminance.channels != 1 || ab.channels != 2 || luminance.Empty() ||
      luminance.width != ab.width || luminance.height != ab.height) {
    throw InvalidArgument(
        "augmentation takes L (1 channel) and ab (2 channels) of one size, but got {}x{} and {}x{}",
        luminance.width,
        luminance.height,
        ab.width,
        ab.height);
  }
  if (options.crop_px < 1 || options.shuffle_grid < 1 || !(options.min_scale > 0.0) ||
      !(options.max_scale >= options.min_scale) || !(options.elastic.sigma_px > 0.0)) {
    throw InvalidArgument(
        "augmentation needs crop_px >= 1, shuffle_grid >= 1, 0 < min_scale <= max_scale and "
        "elastic.sigma_px > 0");
  }
}

// p -> R p / (1 + g . p) about the centre of the crop. Identity by default.
struct Perspective {
  double cosine = 1.0;
  double sine = 0.0;
  double gx = 0.0;
  double gy = 0.0;

  static Perspective Draw(Random& random) {
    Perspective map;
    const double angle = random.NextUniform(-kMaxTilt, kMaxTilt);
    map.cosine = std::cos(angle);
    map.sine = std::sin(angle);
    map.gx = random.NextUniform(-kMaxForeshortening, kMaxForeshortening);
    map.gy = random.NextUniform(-kMaxForeshortening, kMaxForeshortening);
    return map;
  }
  // `half`: half of the crop's side. The result is relative to the centre, too.
  Point Apply(double x, double y, double half) const {
    const double w = 1.0 + (gx * x + gy * y) / half;
    return {(cosine * x - sine * y) / w, (sine * x + cosine * y) / w};
  }
};

// A random augmentation: maps each pixel of the crop to its position in the source. The order, from
// the source, is the paper's: rotation and flip, shuffle, scale, elastic, perspective, crop.
class SamplingMap {
 public:
  SamplingMap(int width, int height, const AugmentOptions& options, Random& random)
      : width_(width), height_(height), crop_(options.crop_px) {
    flip_x_ = random.NextUniform() < options.flip_probability;
    quarter_turns_ = random.NextUniform() < options.rot90_probability
                         ? static_cast<int>(random.NextBelow(4))
                         : 0;
    if (quarter_turns_ % 2 == 1) std::swap(width_, height_);
    if (random.NextUniform() < options.shuffle_probability) DrawShuffle(options, random);
    const double log_scale =
        random.NextUniform(std::log(options.min_scale), std::log(options.max_scale));
    step_ = std::exp(-log_scale);
    if (random.NextUniform() < options.elastic_probability) {
      DrawElastic(options.elastic, random);
    }
    if (random.NextUniform() < options.perspective_probability) {
      perspective_ = Perspective::Draw(random);
    }
    center_.x = DrawCenter(width_, random);
    center_.y = DrawCenter(height_, random);
  }

  struct Source {
    Point position;  // pixel centres at integers
    // Range of pixels for interpolation, inclusive.
    int min_x = 0, max_x = 0, min_y = 0, max_y = 0;
    bool inside = false;
  };

  Source At(int x, int y) const {
    const double half = 0.5 * crop_;
    // From here on continuous coordinates: a pixel covers [i, i + 1].
    Point p = perspective_.Apply(x + 0.5 - half, y + 0.5 - half, half);
    if (spline_) p = p + spline_->At(x + 0.5, y + 0.5);
    if (noise_) p = noise_->Affine(p + noise_->At(x, y));
    p = {center_.x + p.x * step_, center_.y + p.y * step_};
    Source source;
    source.inside = p.x >= 0.0 && p.y >= 0.0 && p.x <= width_ && p.y <= height_;
    p = {Reflected(p.x, width_), Reflected(p.y, height_)};
    source.max_x = width_ - 1;
    source.max_y = height_ - 1;
    if (!cells_.empty()) Unshuffle(p, source);
    UndoRotation(p, source);
    source.position = {p.x - 0.5, p.y - 0.5};
    return source;
  }

 private:
  // Places the crop inside the picture if it fits, else in its centre.
  double DrawCenter(int side, Random& random) const {
    const double half = 0.5 * crop_ * step_;
    const double u = random.NextUniform();
    return side > 2.0 * half ? half + u * (side - 2.0 * half) : 0.5 * side;
  }

  void DrawElastic(const ElasticOptions& options, Random& random) {
    if (options.kind == ElasticOptions::Kind::kSpline) {
      spline_.emplace(crop_, options.alpha_px, options.sigma_px, random);
    } else {
      noise_.emplace(crop_, std::min(width_, height_), options, random);
    }
  }

  void DrawShuffle(const AugmentOptions& options, Random& random) {
    // Cells of equal size, so that they are interchangeable. The remainder stays in place.
    grid_ = options.shuffle_grid;
    cell_width_ = width_ / grid_;
    cell_height_ = height_ / grid_;
    if (cell_width_ == 0 || cell_height_ == 0) return;
    cells_.resize(static_cast<size_t>(grid_) * grid_);
    std::iota(cells_.begin(), cells_.end(), 0);
    for (size_t i = cells_.size() - 1; i > 0; --i) {
      std::swap(cells_[i], cells_[random.NextBelow(static_cast<uint32_t>(i + 1))]);
    }
  }

  void Unshuffle(Point& p, Source& source) const {
    const int column = static_cast<int>(p.x) / cell_width_;
    const int row = static_cast<int>(p.y) / cell_height_;
    if (column >= grid_ || row >= grid_) return;
    const int from = cells_[static_cast<size_t>(row) * grid_ + column];
    const int left = from % grid_ * cell_width_;
    const int top = from / grid_ * cell_height_;
    p.x += left - column * cell_width_;
    p.y += top - row * cell_height_;
    source.min_x = left;
    source.max_x = left + cell_width_ - 1;
    source.min_y = top;
    source.max_y = top + cell_height_ - 1;
  }

  // Inverts rotation and flip: maps coordinates of the rotated picture to the source.
  void UndoRotation(Point& p, Source& source) const {
    int width = width_;
    int height = height_;
    for (int i = 0; i < quarter_turns_; ++i) {
      // One quarter turn back, which swaps the sides.
      p = {p.y, width - p.x};
      const Source turned = source;
      source.min_x = turned.min_y;
      source.max_x = turned.max_y;
      source.min_y = width - 1 - turned.max_x;
      source.max_y = width - 1 - turned.min_x;
      std::swap(width, height);
    }
    if (flip_x_) {
      p.x = width - p.x;
      const int min_x = width - 1 - source.max_x;
      source.max_x = width - 1 - source.min_x;
      source.min_x = min_x;
    }
  }

  int width_;  // of the rotated picture
  int height_;
  int crop_;
  bool flip_x_ = false;
  int quarter_turns_ = 0;
  int grid_ = 0;
  int cell_width_ = 0;
  int cell_height_ = 0;
  std::vector<int> cells_;  // cells_[place] = cell of the rotated picture at that place
  double step_ = 1.0;       // source px per crop px
  Point center_;
  std::optional<ElasticField> spline_;
  std::optional<ElasticNoise> noise_;
  Perspective perspective_;
};

// Two pixels and the weight of the second along one axis.
struct Tap {
  int first = 0;
  int second = 0;
  float weight = 0.0f;
};

Tap MakeTap(double position, int low, int high) {
  const double clamped = std::clamp(position, static_cast<double>(low), static_cast<double>(high));
  Tap tap;
  tap.first = static_cast<int>(clamped);
  tap.second = std::min(tap.first + 1, high);
  tap.weight = static_cast<float>(clamped - tap.first);
  return tap;
}

float Sample(const float* plane, int stride, const Tap& x, const Tap& y) {
  const float* row0 = plane + static_cast<size_t>(y.first) * stride;
  const float* row1 = plane + static_cast<size_t>(y.second) * stride;
  const float top = row0[x.first] + x.weight * (row0[x.second] - row0[x.first]);
  const float bottom = row1[x.first] + x.weight * (row1[x.second] - row1[x.first]);
  return top + y.weight * (bottom - top);
}

}  // namespace

AugmentOptions AugmentOptions::Paper() {
  AugmentOptions options;
  options.min_scale = 1.0;
  options.max_scale = 1.0;
  options.luminance_jitter = 0.0;
  options.perspective_probability = 0.0;
  options.elastic.kind = ElasticOptions::Kind::kNoise;
  options.rot90_probability = 1.0;
  options.shuffle_probability = 0.7;
  return options;
}

AugmentOptions AugmentOptions::CropsOnly() {
  AugmentOptions options;
  options.min_scale = 1.0;
  options.max_scale = 1.0;
  options.flip_probability = 0.0;
  options.elastic_probability = 0.0;
  options.perspective_probability = 0.0;
  options.luminance_jitter = 0.0;
  return options;
}

AugmentedSample Augment(const Image& luminance,
                        const Image& ab,
                        const Image& weight,
                        const AugmentOptions& options,
                        Random& random) {
  Check(luminance, ab, options);
  if (!weight.Empty() && (weight.channels != 1 || weight.width != luminance.width ||
                          weight.height != luminance.height)) {
    throw InvalidArgument("the weights of a picture to augment are {}x{} px, but the picture {}x{}",
                          weight.width,
                          weight.height,
                          luminance.width,
                          luminance.height);
  }
  const SamplingMap map(luminance.width, luminance.height, options, random);
  const float offset =
      static_cast<float>(random.NextUniform(-options.luminance_jitter, options.luminance_jitter));
  const float contrast = 1.0f + 0.01f * static_cast<float>(random.NextUniform(
                                            -options.luminance_jitter, options.luminance_jitter));
  const int side = options.crop_px;
  AugmentedSample sample{Image(side, side, 1), Image(side, side, 2), Image(side, side, 1)};
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const SamplingMap::Source source = map.At(x, y);
      const Tap tap_x = MakeTap(source.position.x, source.min_x, source.max_x);
      const Tap tap_y = MakeTap(source.position.y, source.min_y, source.max_y);
      const float l = Sample(luminance.Plane(0), luminance.width, tap_x, tap_y);
      // Without jitter, L must not change by a bit.
      sample.luminance.At(0, y, x) =
          options.luminance_jitter > 0.0
              ? std::clamp(50.0f + contrast * (l - 50.0f) + offset, 0.0f, 100.0f)
              : l;
      sample.ab.At(0, y, x) = Sample(ab.Plane(0), ab.width, tap_x, tap_y);
      sample.ab.At(1, y, x) = Sample(ab.Plane(1), ab.width, tap_x, tap_y);
      float valid = source.inside ? 1.0f : 0.0f;
      if (!weight.Empty()) valid *= Sample(weight.Plane(0), weight.width, tap_x, tap_y);
      sample.valid.At(0, y, x) = valid;
    }
  }
  return sample;
}

}  // namespace color3d
