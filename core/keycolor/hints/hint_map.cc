#include "core/keycolor/hints/hint_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/image/image_checks.h"

namespace color3d {
namespace {

constexpr float kAlphaOfHint = 0.5f;
constexpr float kChromaOfHint = 6.0f;
// Distance of colours (Lab units) above which overlapping hints contradict each other.
constexpr float kSameColor = 3.0f;

using Point = std::array<double, 2>;

// Squared distance from a point to the segment p q.
double SquaredDistance(double x, double y, const Point& p, const Point& q) {
  const double dx = q[0] - p[0], dy = q[1] - p[1];
  const double length = dx * dx + dy * dy;
  double t = length > 0.0 ? ((x - p[0]) * dx + (y - p[1]) * dy) / length : 0.0;
  t = std::clamp(t, 0.0, 1.0);
  const double ex = x - p[0] - t * dx, ey = y - p[1] - t * dy;
  return ex * ex + ey * ey;
}

class HintDrawer {
 public:
  HintDrawer(const HintPictures& pictures, int width, int height)
      : pictures_(pictures), width_(width), height_(height) {
    map_.hinted.assign(static_cast<size_t>(width) * height, 0);
    map_.ab = Image(width, height, 2);
    entry_of_.assign(map_.hinted.size(), -1);
  }

  void Draw(int64_t entry, const ColorHint& hint) {
    entry_ = entry;
    hint_ = &hint;
    drawn_ = 0;
    CheckColor();
    if (hint.fill == ColorHint::Fill::kAutomatic) map_.kept.resize(map_.hinted.size(), 0);
    switch (hint.shape) {
      case ColorHint::Shape::kDisc:
        DrawDisc();
        break;
      case ColorHint::Shape::kLine:
        DrawLine();
        break;
      case ColorHint::Shape::kRegion:
        DrawRegion();
        break;
      case ColorHint::Shape::kLabel:
        DrawLabel();
        break;
    }
    if (drawn_ == 0 && pictures_.is_reduced) DrawSomePixel();
    if (drawn_ == 0) throw InvalidArgument("{} covers no pixel of the photo", Name());
  }

  void WarnOfContradictions(ProgressObserver& progress) const {
    if (contradictions_ == 0) return;
    progress.OnWarning(
        fmt::format("colour hints: {} pixels have two different colours; the later entry wins "
                    "(first by {} and {})",
                    contradictions_,
                    first_pair_[0],
                    first_pair_[1]));
  }
  HintMap Take() { return std::move(map_); }

 private:
  std::string Name() const { return fmt::format("colour hint {}", entry_); }

  void CheckColor() const {
    if (!(std::abs(hint_->a) <= 128.0) || !(std::abs(hint_->b) <= 128.0)) {
      throw InvalidArgument("{} has a colour outside -128..128 Lab units", Name());
    }
    if (hint_->fill == ColorHint::Fill::kAutomatic && pictures_.automatic_ab == nullptr) {
      throw InvalidArgument("{} keeps the automatic colours, but no automatic colourizer was run",
                            Name());
    }
  }

  void CheckPoint(double x, double y, bool border_is_inside) const {
    const bool inside = border_is_inside ? x >= 0.0 && x <= width_ && y >= 0.0 && y <= height_
                                         : x >= 0.0 && x < width_ && y >= 0.0 && y < height_;
    if (inside) return;
    throw InvalidArgument(
        "{} at ({}, {}) lies outside the photo of {}x{} px", Name(), x, y, width_, height_);
  }

  void CheckRadius() const {
    if (!(hint_->radius_px >= 0.0) || !std::isfinite(hint_->radius_px)) {
      throw InvalidArgument("{} has the radius {} px; it must be >= 0", Name(), hint_->radius_px);
    }
  }

  void Set(int x, int y) {
    const size_t i = static_cast<size_t>(y) * width_ + x;
    float a = static_cast<float>(hint_->a), b = static_cast<float>(hint_->b);
    if (hint_->fill == ColorHint::Fill::kNeutral) a = b = 0.0f;
    if (hint_->fill == ColorHint::Fill::kAutomatic) {
      a = pictures_.automatic_ab->Plane(0)[i];
      b = pictures_.automatic_ab->Plane(1)[i];
    }
    float* as = map_.ab.Plane(0);
    float* bs = map_.ab.Plane(1);
    if (map_.hinted[i] && entry_of_[i] != entry_ && std::hypot(as[i] - a, bs[i] - b) > kSameColor) {
      if (contradictions_++ == 0) first_pair_ = {entry_of_[i], entry_};
    }
    map_.hinted[i] = 1;
    if (!map_.kept.empty()) map_.kept[i] = hint_->fill == ColorHint::Fill::kAutomatic;
    entry_of_[i] = static_cast<int32_t>(entry_);
    as[i] = a;
    bs[i] = b;
    ++drawn_;
  }

  // Capsule around a segment, at least the pixels at its ends.
  void DrawSegment(const Point& p, const Point& q) {
    const double radius = hint_->radius_px;
    const auto low = [&](double v, int side) {
      return static_cast<int>(std::clamp(std::floor(v - radius), 0.0, side - 1.0));
    };
    const auto high = [&](double v, int side) {
      return static_cast<int>(std::clamp(std::floor(v + radius), 0.0, side - 1.0));
    };
    const auto under = [&](const Point& end, int x, int y) {
      return x == std::min(static_cast<int>(end[0]), width_ - 1) &&
             y == std::min(static_cast<int>(end[1]), height_ - 1);
    };
    for (int y = low(std::min(p[1], q[1]), height_); y <= high(std::max(p[1], q[1]), height_);
         ++y) {
      for (int x = low(std::min(p[0], q[0]), width_); x <= high(std::max(p[0], q[0]), width_);
           ++x) {
        const bool inside = SquaredDistance(x + 0.5, y + 0.5, p, q) <= radius * radius;
        if (inside || under(p, x, y) || under(q, x, y)) Set(x, y);
      }
    }
  }

  void DrawDisc() {
    CheckPoint(hint_->x_px, hint_->y_px, /*border_is_inside=*/false);
    CheckRadius();
    const Point center{hint_->x_px, hint_->y_px};
    DrawSegment(center, center);
  }

  void DrawLine() {
    CheckRadius();
    const std::vector<Point>& points = hint_->points_px;
    if (points.empty()) throw InvalidArgument("{} is a line without points", Name());
    for (const Point& point : points) CheckPoint(point[0], point[1], /*border_is_inside=*/true);
    for (size_t k = 0; k + 1 < points.size(); ++k) DrawSegment(points[k], points[k + 1]);
    if (points.size() == 1) DrawSegment(points[0], points[0]);
  }

  // Pixels with centres inside, by the even-odd rule.
  void DrawRegion() {
    const std::vector<Point>& points = hint_->points_px;
    if (points.size() < 3) {
      throw InvalidArgument(
          "{} is a region of {} points, but needs at least 3", Name(), points.size());
    }
    for (const Point& point : points) CheckPoint(point[0], point[1], /*border_is_inside=*/true);
    std::vector<double> crossings;
    for (int y = 0; y < height_; ++y) {
      const double middle = y + 0.5;
      crossings.clear();
      for (size_t k = 0; k < points.size(); ++k) {
        const Point& p = points[k];
        const Point& q = points[(k + 1) % points.size()];
        if ((p[1] <= middle) == (q[1] <= middle)) continue;
        crossings.push_back(p[0] + (middle - p[1]) / (q[1] - p[1]) * (q[0] - p[0]));
      }
      std::sort(crossings.begin(), crossings.end());
      for (size_t k = 0; k + 1 < crossings.size(); k += 2) {
        const int first = std::max(0, static_cast<int>(std::ceil(crossings[k] - 0.5)));
        const int end = std::min(width_, static_cast<int>(std::ceil(crossings[k + 1] - 0.5)));
        for (int x = first; x < end; ++x) Set(x, y);
      }
    }
  }

  // The pixel at the beginning of a line or region.
  void DrawSomePixel() {
    if (hint_->points_px.empty()) return;
    const Point& point = hint_->points_px[0];
    Set(std::min(static_cast<int>(point[0]), width_ - 1),
        std::min(static_cast<int>(point[1]), height_ - 1));
  }

  void DrawLabel() {
    if (pictures_.labels == nullptr) {
      throw InvalidArgument(
          "{} names the label {}, but there is no label picture", Name(), hint_->label);
    }
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const float value = pictures_.labels->At(0, y, x) * 255.0f;
        if (std::abs(value - static_cast<float>(hint_->label)) < 0.5f) Set(x, y);
      }
    }
  }

  const HintPictures& pictures_;
  int width_, height_;
  HintMap map_;
  std::vector<int32_t> entry_of_;
  int64_t entry_ = 0;
  const ColorHint* hint_ = nullptr;
  int64_t drawn_ = 0;
  int64_t contradictions_ = 0;
  std::array<int64_t, 2> first_pair_{};
};

void CheckPicture(const Image* picture, const char* what, int channels, int width, int height) {
  if (picture == nullptr) return;
  if (picture->width == width && picture->height == height && picture->channels == channels) return;
  throw InvalidArgument("{} is {}x{} px with {} channels, the key view needs {}x{} px with {}",
                        what,
                        picture->width,
                        picture->height,
                        picture->channels,
                        width,
                        height,
                        channels);
}

}  // namespace

void RequireFiniteLuminance(const Image& luminance, const char* user) {
  RequireLuminance(luminance, user);
  if (!IsFinite(luminance)) {
    throw InvalidArgument("the key view's luminance has a value that is not finite");
  }
}

HintMap DrawHints(const std::vector<ColorHint>& hints,
                  const HintPictures& pictures,
                  int width,
                  int height,
                  ProgressObserver& progress,
                  const CancellationToken& cancel) {
  if (hints.empty()) throw InvalidArgument("no colour hint; give at least one");
  CheckPicture(pictures.labels, "the label picture", 1, width, height);
  CheckPicture(pictures.automatic_ab, "the automatic colouring", 2, width, height);
  HintDrawer drawer(pictures, width, height);
  for (size_t i = 0; i < hints.size(); ++i) {
    cancel.ThrowIfCancelled();
    drawer.Draw(static_cast<int64_t>(i), hints[i]);
  }
  drawer.WarnOfContradictions(progress);
  return drawer.Take();
}

HintMap HintsFromStrokes(const Image& strokes) {
  Image rgb(strokes.width, strokes.height, 3);
  std::copy_n(strokes.data.begin(), rgb.data.size(), rgb.data.begin());
  for (float& value : rgb.data) value = std::isfinite(value) ? value : 0.0f;
  const Image lab = LabFromSrgb(rgb);
  HintMap map{std::vector<uint8_t>(lab.PlaneSize()), ChromaOfLab(lab)};
  for (size_t i = 0; i < lab.PlaneSize(); ++i) {
    map.hinted[i] = strokes.channels == 4
                        ? strokes.Plane(3)[i] > kAlphaOfHint
                        : std::hypot(lab.Plane(1)[i], lab.Plane(2)[i]) > kChromaOfHint;
  }
  return map;
}

HintMap ReduceHints(const HintMap& full, int width, int height) {
  Image weighted(full.ab.width, full.ab.height, full.kept.empty() ? 3 : 4);
  for (size_t i = 0; i < full.hinted.size(); ++i) {
    if (!full.hinted[i]) continue;
    weighted.Plane(0)[i] = full.ab.Plane(0)[i];
    weighted.Plane(1)[i] = full.ab.Plane(1)[i];
    weighted.Plane(2)[i] = 1.0f;
    if (!full.kept.empty()) weighted.Plane(3)[i] = full.kept[i];
  }
  weighted = Resize(weighted, width, height);
  HintMap small{std::vector<uint8_t>(weighted.PlaneSize(), 0), Image(width, height, 2)};
  if (!full.kept.empty()) small.kept.resize(weighted.PlaneSize(), 0);
  for (size_t i = 0; i < small.hinted.size(); ++i) {
    const float share = weighted.Plane(2)[i];
    if (share < 1e-4f) continue;
    small.hinted[i] = 1;
    small.ab.Plane(0)[i] = weighted.Plane(0)[i] / share;
    small.ab.Plane(1)[i] = weighted.Plane(1)[i] / share;
    if (!full.kept.empty()) small.kept[i] = weighted.Plane(3)[i] > 0.5f * share;
  }
  return small;
}

}  // namespace color3d
