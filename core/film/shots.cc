#include "core/film/shots.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/median.h"
#include "core/film/tones_of_picture.h"

namespace color3d {
namespace {

constexpr double kBlankDeviation = 1.5;  // of L; more than the grain of a blank frame
constexpr int kMaxShiftPx = 5;           // between thumbnails, in a fast pan
// Least unlikeness at a cut, and its least ratio to the usual one around it.
constexpr double kCutUnlikeness = 0.55;
constexpr double kCutOverUsual = 2.5;
constexpr int kUsualFrames = 6;  // to either side
constexpr int kMaxAlien = 2;     // successive torn frames

Image Normalized(const Image& image) {
  const TonesOfPicture tones(image);
  Image out = image;
  const double scale = 1.0 / std::max(kBlankDeviation, tones.deviation);
  for (float& v : out.data) v = static_cast<float>((v - tones.mean) * scale);
  return out;
}

double Difference(const Image& one, const Image& other, int dx, int dy) {
  const int x0 = std::max(0, -dx), x1 = std::min(one.width, one.width - dx);
  const int y0 = std::max(0, -dy), y1 = std::min(one.height, one.height - dy);
  if (x1 <= x0 || y1 <= y0) return 1e9;
  double sum = 0.0;
  for (int y = y0; y < y1; ++y) {
    const float* a = one.Plane(0) + static_cast<size_t>(y) * one.width;
    const float* b = other.Plane(0) + static_cast<size_t>(y + dy) * one.width + dx;
    for (int x = x0; x < x1; ++x) sum += std::abs(a[x] - b[x]);
  }
  return sum / (static_cast<double>(x1 - x0) * (y1 - y0));
}

// ShotDissimilarity of two normalised pictures.
double UnlikenessOfNormalized(const Image& one, const Image& other) {
  double best = 1e9;
  const int limit_x = std::min(kMaxShiftPx, one.width / 4),
            limit_y = std::min(kMaxShiftPx, one.height / 4);
  for (int dy = -limit_y; dy <= limit_y; ++dy) {
    for (int dx = -limit_x; dx <= limit_x; ++dx) {
      best = std::min(best, Difference(one, other, dx, dy));
    }
  }
  return best;
}

// Usual unlikeness of the steps around the one between frames k and k + 1.
double Usual(const std::vector<double>& steps, int k) {
  std::vector<double> around;
  for (int i = std::max(0, k - kUsualFrames);
       i <= std::min(static_cast<int>(steps.size()) - 1, k + kUsualFrames);
       ++i) {
    if (i != k) around.push_back(steps[i]);
  }
  return around.empty() ? 0.0 : Median(std::move(around));
}

}  // namespace

double ShotDissimilarity(const Image& one, const Image& other) {
  if (one.channels != 1 || other.channels != 1 || one.width != other.width ||
      one.height != other.height || one.Empty()) {
    throw InvalidArgument("the frames of a film must have one channel and equal sizes");
  }
  return UnlikenessOfNormalized(Normalized(one), Normalized(other));
}

FilmShots FindShots(const std::vector<Image>& thumbnails) {
  FilmShots result;
  const int count = static_cast<int>(thumbnails.size());
  result.fault.assign(count, FrameFault::kNone);
  result.shot.assign(count, 0);
  std::vector<int> kept;  // frames that are not blank
  std::vector<Image> normalized;
  for (int i = 0; i < count; ++i) {
    const Image& image = thumbnails[i];
    if (image.channels != 1 || image.width != thumbnails[0].width ||
        image.height != thumbnails[0].height || image.Empty()) {
      throw InvalidArgument("the frames of a film must have one channel and equal sizes");
    }
    if (TonesOfPicture(image).deviation < kBlankDeviation) {
      result.fault[i] = FrameFault::kBlank;
    } else {
      kept.push_back(i);
      normalized.push_back(Normalized(image));
    }
  }
  std::vector<double> steps;  // between kept frames k and k + 1
  for (size_t k = 0; k + 1 < kept.size(); ++k) {
    steps.push_back(UnlikenessOfNormalized(normalized[k], normalized[k + 1]));
  }
  const auto is_cut = [&](int k) {
    return steps[k] > kCutUnlikeness && steps[k] > kCutOverUsual * Usual(steps, k);
  };
  // One or two frames between two cuts are alien if the frames around them are alike.
  const int count_of_steps = static_cast<int>(steps.size());
  std::vector<bool> cut(steps.size(), false);
  for (int k = 0; k < count_of_steps; ++k) cut[k] = is_cut(k);
  for (int k = 0; k < count_of_steps; ++k) {
    for (int aliens = 1; cut[k] && aliens <= kMaxAlien && k + aliens < count_of_steps; ++aliens) {
      if (!cut[k + aliens]) continue;
      if (UnlikenessOfNormalized(normalized[k], normalized[k + aliens + 1]) > kCutUnlikeness)
        continue;
      for (int i = 1; i <= aliens; ++i) result.fault[kept[k + i]] = FrameFault::kAlien;
      std::fill_n(cut.begin() + k, aliens + 1, false);
    }
  }
  // Frames with faults are numbered behind the shots.
  int shot = 0;
  for (size_t k = 0; k < kept.size(); ++k) {
    if (k > 0 && cut[k - 1]) {
      ++shot;
      result.cuts.push_back(kept[k]);
    }
    result.shot[kept[k]] = shot;
  }
  result.count = kept.empty() ? 0 : shot + 1;
  for (int i = 0; i < count; ++i) {
    if (result.fault[i] != FrameFault::kNone) result.shot[i] = result.count++;
  }
  return result;
}

}  // namespace color3d
