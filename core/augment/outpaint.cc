#include "core/augment/outpaint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/image/crop.h"
#include "core/image/fill_holes.h"

namespace color3d {
namespace {

constexpr int kSearchSidePx = 160;     // longer side of the picture for comparison of patches
constexpr double kPatchShare = 0.12;   // of the longer side
constexpr double kOverlapShare = 0.3;  // of the patch
// Maximum excess of the error of a patch's overlap over the best one's to be a candidate (Efros &
// Freeman: 0.1).
constexpr double kTolerance = 0.1;
// Penalty, Lab units squared per pixel, of patches from the other end of the picture's height,
// since the world is upright, and of patches that were used before.
constexpr double kHeightCost = 1200.0;
constexpr double kReuseCost = 12.0;
// Maximum step across a seam, Lab units, that counts as shading and is smoothed. Larger ones are
// edges.
constexpr float kMaxStep = 12.0f;

struct Position {
  int x = 0;
  int y = 0;
};

struct Axis {
  std::vector<int> starts;    // of the patches
  std::vector<int> overlaps;  // overlap of each with the one before, px
};

// Patches that cover [begin + overlap, end), each with an overlap of `overlap` px or more.
Axis CoverAxis(int begin, int end, int patch, int overlap, bool filled_before) {
  Axis axis;
  int filled_to = filled_before ? begin + overlap : begin;
  for (int start = begin;; start += patch - overlap) {
    const int clamped = std::min(start, end - patch);
    axis.starts.push_back(clamped);
    axis.overlaps.push_back(std::max(0, filled_to - clamped));
    filled_to = clamped + patch;
    if (filled_to >= end) return axis;
  }
}

Image Mirrored(const Image& image, bool flip_x, bool flip_y) {
  Image out(image.width, image.height, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    for (int y = 0; y < image.height; ++y) {
      const int from_y = flip_y ? image.height - 1 - y : y;
      for (int x = 0; x < image.width; ++x) {
        out.At(c, y, x) = image.At(c, from_y, flip_x ? image.width - 1 - x : x);
      }
    }
  }
  return out;
}

Image Shrunk(const Image& image, int factor) {
  Image out(image.width / factor, image.height / factor, image.channels);
  const float share = 1.0f / static_cast<float>(factor * factor);
  for (int c = 0; c < image.channels; ++c) {
    for (int y = 0; y < out.height * factor; ++y) {
      for (int x = 0; x < out.width * factor; ++x) {
        out.At(c, y / factor, x / factor) += share * image.At(c, y, x);
      }
    }
  }
  return out;
}

// Returns for each of `length` places along a strip the depth at which the new patch starts: the
// cheapest connected path through `cost` (length x depth, row-major).
std::vector<int> CheapestCut(const std::vector<float>& cost, int length, int depth) {
  std::vector<float> total = cost;
  for (int i = 1; i < length; ++i) {
    for (int d = 0; d < depth; ++d) {
      const float* before = &total[static_cast<size_t>(i - 1) * depth];
      const int low = std::max(d - 1, 0), high = std::min(d + 1, depth - 1);
      total[static_cast<size_t>(i) * depth + d] +=
          *std::min_element(before + low, before + high + 1);
    }
  }
  std::vector<int> cut(static_cast<size_t>(length));
  int low = 0, high = depth - 1;
  for (int i = length - 1; i >= 0; --i) {
    const float* row = &total[static_cast<size_t>(i) * depth];
    cut[static_cast<size_t>(i)] =
        static_cast<int>(std::min_element(row + low, row + high + 1) - row);
    low = std::max(cut[static_cast<size_t>(i)] - 1, 0);
    high = std::min(cut[static_cast<size_t>(i)] + 1, depth - 1);
  }
  return cut;
}

// Extends the canvas from its filled upper left corner to the right and downwards.
class Quilter {
 public:
  // `source`: mirrored such that its lower right quadrant becomes the corner.
  Quilter(const Image& source, Random& random)
      : source_(source),
        random_(random),
        canvas_(source.width, source.height, 3),
        known_width_((source.width + 1) / 2),
        known_height_((source.height + 1) / 2) {
    const int longer = std::max(source.width, source.height);
    factor_ = std::max(1, longer / kSearchSidePx);
    const int shorter = std::min(known_width_, known_height_);
    patch_ = std::min(static_cast<int>(kPatchShare * longer), shorter) / factor_ * factor_;
    overlap_ = std::max(2, static_cast<int>(kOverlapShare * patch_));
    small_ = Shrunk(source, factor_);
    reuse_.assign(small_.PlaneSize(), 0.0f);
    for (int c = 0; c < 3; ++c) {
      for (int y = 0; y < known_height_; ++y) {
        for (int x = 0; x < known_width_; ++x) {
          canvas_.At(c, y, x) =
              source.At(c, y + source.height - known_height_, x + source.width - known_width_);
        }
      }
    }
  }

  GeneratedPicture Run(const CancellationToken& cancel) {
    const int right = known_width_ - overlap_, below = known_height_ - overlap_;
    Fill(CoverAxis(right, source_.width, patch_, overlap_, true),
         CoverAxis(0, known_height_, patch_, overlap_, false),
         cancel);
    Fill(CoverAxis(0, source_.width, patch_, overlap_, false),
         CoverAxis(below, source_.height, patch_, overlap_, true),
         cancel);
    Image weight(source_.width, source_.height, 1, kRearrangedWeight);
    for (int y = 0; y < known_height_; ++y) {
      std::fill_n(&weight.At(0, y, 0), known_width_, 1.0f);
    }
    return {std::move(canvas_), std::move(weight)};
  }

 private:
  // Position of the patch on the canvas and overlap with earlier ones.
  struct Place {
    Position at;
    int left = 0;
    int top = 0;
  };

  void Fill(const Axis& columns, const Axis& rows, const CancellationToken& cancel) {
    for (size_t j = 0; j < rows.starts.size(); ++j) {
      for (size_t i = 0; i < columns.starts.size(); ++i) {
        cancel.ThrowIfCancelled();
        const Place place{
            {columns.starts[i], rows.starts[j]}, columns.overlaps[i], rows.overlaps[j]};
        Paste(place, Refined(place, Search(place)));
      }
    }
  }

  // Sum of squared differences over the overlap, aborted above `bound`. In pixels of `source` and
  // `canvas`, at either scale.
  static double Difference(const Image& source,
                           const Position& from,
                           const Image& patch,
                           int left,
                           int top,
                           double bound) {
    double sum = 0.0;
    for (int y = 0; y < patch.height; ++y) {
      const int width = y < top ? patch.width : left;
      if (width == 0) break;
      float row_sum = 0.0f;
      for (int c = 0; c < 3; ++c) {
        const float* a = &source.Plane(c)[static_cast<size_t>(from.y + y) * source.width + from.x];
        const float* b = &patch.Plane(c)[static_cast<size_t>(y) * patch.width];
        for (int x = 0; x < width; ++x) row_sum += (a[x] - b[x]) * (a[x] - b[x]);
      }
      sum += row_sum;
      if (sum > bound) return sum;
    }
    return sum;
  }

  Image CanvasPatch(const Position& at) const { return Crop(canvas_, at.x, at.y, patch_, patch_); }

  // Row of the source that continues at this row of the canvas, clamped to the picture.
  double HeightCost(const Place& place, int source_y) const {
    const int wanted =
        std::min(place.at.y + source_.height - known_height_, source_.height - patch_);
    const double share = static_cast<double>(source_y - wanted) / source_.height;
    return kHeightCost * share * share;
  }

  // Upper left corner of the source patch, at multiples of the factor.
  Position Search(const Place& place) {
    const Image patch = Shrunk(CanvasPatch(place.at), factor_);
    const int left = place.left / factor_, top = place.top / factor_;
    const double pixels =
        static_cast<double>(top) * patch.width + static_cast<double>(patch.height - top) * left;
    struct Candidate {
      Position at;
      double cost;
    };
    std::vector<Candidate> candidates;
    double best = std::numeric_limits<double>::max();
    for (int y = 0; y + patch.height <= small_.height; ++y) {
      for (int x = 0; x + patch.width <= small_.width; ++x) {
        const double extra = HeightCost(place, y * factor_) +
                             kReuseCost * reuse_[static_cast<size_t>(y) * small_.width + x];
        const double bound = best * (1.0 + kTolerance) - extra * pixels;
        if (bound < 0.0) continue;
        const double cost = extra * pixels + Difference(small_, {x, y}, patch, left, top, bound);
        if (cost > best * (1.0 + kTolerance)) continue;
        best = std::min(best, cost);
        candidates.push_back({{x, y}, cost});
      }
    }
    std::erase_if(candidates,
                  [&](const Candidate& c) { return c.cost > best * (1.0 + kTolerance); });
    const Position chosen =
        candidates[random_.NextBelow(static_cast<uint32_t>(candidates.size()))].at;
    MarkUsed(chosen, patch.width);
    return {chosen.x * factor_, chosen.y * factor_};
  }

  void MarkUsed(const Position& at, int patch) {
    const int reach = patch / 2;
    for (int y = std::max(0, at.y - reach); y <= std::min(small_.height - 1, at.y + reach); ++y) {
      for (int x = std::max(0, at.x - reach); x <= std::min(small_.width - 1, at.x + reach); ++x) {
        reuse_[static_cast<size_t>(y) * small_.width + x] += 1.0f;
      }
    }
  }

  Position Refined(const Place& place, const Position& coarse) const {
    const Image patch = CanvasPatch(place.at);
    Position best = coarse;
    double least = std::numeric_limits<double>::max();
    for (int dy = 1 - factor_; dy < factor_; ++dy) {
      for (int dx = 1 - factor_; dx < factor_; ++dx) {
        const Position at{std::clamp(coarse.x + dx, 0, source_.width - patch_),
                          std::clamp(coarse.y + dy, 0, source_.height - patch_)};
        const double cost = Difference(source_, at, patch, place.left, place.top, least);
        if (cost < least) {
          least = cost;
          best = at;
        }
      }
    }
    return best;
  }

  float PixelDifference(const Place& place, const Position& from, int x, int y) const {
    float sum = 0.0f;
    for (int c = 0; c < 3; ++c) {
      const float d =
          canvas_.At(c, place.at.y + y, place.at.x + x) - source_.At(c, from.y + y, from.x + x);
      sum += d * d;
    }
    return sum;
  }

  void Paste(const Place& place, const Position& from) {
    // `depth`: px of the overlap that the cut runs through.
    const auto cut = [&](int depth, bool beside) {
      if (depth == 0) return std::vector<int>(static_cast<size_t>(patch_), 0);
      std::vector<float> cost(static_cast<size_t>(patch_) * depth);
      for (size_t i = 0; i < cost.size(); ++i) {
        const int along = static_cast<int>(i) / depth, across = static_cast<int>(i) % depth;
        cost[i] = PixelDifference(place, from, beside ? across : along, beside ? along : across);
      }
      return CheapestCut(cost, patch_, depth);
    };
    const std::vector<int> first_x = cut(place.left, true), first_y = cut(place.top, false);
    const Image step = StepAcrossSeam(place, from, first_x, first_y);
    for (int y = 0; y < patch_; ++y) {
      for (int x = 0; x < patch_; ++x) {
        const int depth =
            std::min(x - first_x[static_cast<size_t>(y)], y - first_y[static_cast<size_t>(x)]);
        if (depth < 0) continue;
        const float share = 1.0f - static_cast<float>(depth) / static_cast<float>(patch_);
        for (int c = 0; c < 3; ++c) {
          const float value = source_.At(c, from.y + y, from.x + x) + share * step.At(c, y, x);
          canvas_.At(c, place.at.y + y, place.at.x + x) =
              c == 0 ? std::clamp(value, 0.0f, 100.0f) : value;
        }
      }
    }
  }

  // Difference between canvas and patch along the cut, continued smoothly over the patch; 0 at
  // edges.
  Image StepAcrossSeam(const Place& place,
                       const Position& from,
                       const std::vector<int>& first_x,
                       const std::vector<int>& first_y) const {
    const auto shown = [&](int x, int y) {
      return x < patch_ && y < patch_ && x >= first_x[static_cast<size_t>(y)] &&
             y >= first_y[static_cast<size_t>(x)];
    };
    Image on_cut(patch_, patch_, 1), step(patch_, patch_, 3);
    for (int y = 0; y < patch_; ++y) {
      for (int x = 0; x < patch_; ++x) {
        if (shown(x, y) || !(shown(x + 1, y) || shown(x, y + 1))) continue;
        on_cut.At(0, y, x) = 1.0f;
        if (PixelDifference(place, from, x, y) > kMaxStep * kMaxStep) continue;
        for (int c = 0; c < 3; ++c) {
          step.At(c, y, x) =
              canvas_.At(c, place.at.y + y, place.at.x + x) - source_.At(c, from.y + y, from.x + x);
        }
      }
    }
    FillHoles(on_cut, &step);
    return step;
  }

  const Image& source_;
  Random& random_;
  Image canvas_;
  int known_width_;
  int known_height_;
  int factor_ = 1;  // source px per px of the search
  int patch_ = 0;   // px, a multiple of the factor
  int overlap_ = 0;
  Image small_;
  std::vector<float> reuse_;  // penalty of each search position
};

}  // namespace

GeneratedPicture OutpaintQuadrant(const Image& lab,
                                  Quadrant quadrant,
                                  uint64_t seed,
                                  const CancellationToken& cancel) {
  if (lab.channels != 3 || std::min(lab.width, lab.height) < kMinGeneratedSidePx) {
    throw InvalidArgument(
        "outpainting needs a Lab picture with sides of at least {} px, but got {}x{} with {} "
        "channels",
        kMinGeneratedSidePx,
        lab.width,
        lab.height,
        lab.channels);
  }
  const bool flip_x = quadrant == Quadrant::kUpperLeft || quadrant == Quadrant::kLowerLeft;
  const bool flip_y = quadrant == Quadrant::kUpperLeft || quadrant == Quadrant::kUpperRight;
  // Mirrors twice, so that the patches stay upright.
  const Image source = Mirrored(lab, flip_x, flip_y);
  Random random(seed, /*stream=*/static_cast<uint64_t>(quadrant));
  const GeneratedPicture grown = Quilter(source, random).Run(cancel);
  return {Mirrored(grown.lab, flip_x, flip_y), Mirrored(grown.weight, flip_x, flip_y)};
}

}  // namespace color3d
