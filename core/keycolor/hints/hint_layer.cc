#include "core/keycolor/hints/hint_layer.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/base/error.h"
#include "core/base/range_check.h"
#include "core/grid/edge_weights.h"
#include "core/grid/grid_solver.h"
#include "core/grid/quick_grid.h"
#include "core/image/box_mean.h"
#include "core/image/codec.h"
#include "core/image/guided_upsample.h"
#include "core/image/image_checks.h"
#include "core/keycolor/hints/hint_map.h"

namespace color3d {
namespace {

// Coupling of a smooth grid along one axis: the edge along it and the two diagonals.
constexpr double kAxisCoupling = 1.0 + 1.41421356;
// The pull below which nothing changes, and from which on the colour is that of the strokes.
constexpr float kNoPull = 0.1f, kFullPull = 0.4f;
// Factor of the screening where a place is as unlike as the options say.
constexpr float kScreeningOfUnlike = 6.0f;
constexpr int kTextureRadiusPx = 4;
constexpr int kLikenessRadiusPx = 2;
constexpr float kLeastWeight = 1e-6f;
// Hinted share of a cell from which on its own mean counts alone, so that far hints do not.
constexpr float kFullWeight = 200.0f;
// For quick answers.
constexpr int kLayerHalvings = 2;

// The smallest coupling difference of each pixel (1 channel, L units).
Image SigmaOfTexture(const Image& luminance, const LayerOptions& options) {
  const int w = luminance.width, h = luminance.height;
  Image sigma(w, h, 1);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const float here = luminance.At(0, y, x);
      const float right = luminance.At(0, y, std::min(x + 1, w - 1));
      const float down = luminance.At(0, std::min(y + 1, h - 1), x);
      sigma.At(0, y, x) = 0.5f * (std::abs(here - right) + std::abs(here - down));
    }
  }
  sigma = BoxMean(sigma, kTextureRadiusPx);
  for (float& value : sigma.data) {
    value =
        std::max(static_cast<float>(options.sigma), static_cast<float>(options.texture) * value);
  }
  return sigma;
}

// L, its square, and a, b below: what a place is like.
Image Likeness(const Image& luminance, const Image& below) {
  const Image smooth = BoxMean(luminance, kLikenessRadiusPx);
  const Image smooth_below = BoxMean(below, kLikenessRadiusPx);
  Image like(luminance.width, luminance.height, 4);
  for (size_t i = 0; i < smooth.data.size(); ++i) {
    like.Plane(0)[i] = smooth.data[i];
    like.Plane(1)[i] = smooth.data[i] * smooth.data[i];
    like.Plane(2)[i] = smooth_below.Plane(0)[i];
    like.Plane(3)[i] = smooth_below.Plane(1)[i];
  }
  return like;
}

// Means of the values nearby for every pixel. The last channel of `weighted` is the weight, 0 or 1;
// the others are 0 where it is.
Image MeansNearby(const Image& weighted) {
  const int count = weighted.channels - 1;
  const bool is_last = weighted.PlaneSize() == 1;
  Image means(weighted.width, weighted.height, count);
  if (!is_last) {
    const Image half = Resize(weighted, (weighted.width + 1) / 2, (weighted.height + 1) / 2);
    means = Resize(MeansNearby(half), weighted.width, weighted.height);
  }
  for (size_t i = 0; i < weighted.PlaneSize(); ++i) {
    const float weight = weighted.Plane(count)[i];
    if (weight < kLeastWeight) continue;
    const float own = is_last ? 1.0f : std::min(1.0f, kFullWeight * weight);
    for (int c = 0; c < count; ++c) {
      float& mean = means.Plane(c)[i];
      mean += own * (weighted.Plane(c)[i] / weight - mean);
    }
  }
  return means;
}

// Screening of each pixel: the weight that holds its pull at 0.
GridPlane Screening(const Image& luminance,
                    const Image& below,
                    const HintMap& hints,
                    const LayerOptions& options) {
  const Image like = Likeness(luminance, below);
  Image weighted(like.width, like.height, 5);
  for (size_t i = 0; i < hints.hinted.size(); ++i) {
    if (!hints.hinted[i] || hints.IsKept(i)) continue;
    for (int c = 0; c < 4; ++c) weighted.Plane(c)[i] = like.Plane(c)[i];
    weighted.Plane(4)[i] = 1.0f;
  }
  const Image strokes = MeansNearby(weighted);
  const double reach_px = options.reach * std::max(luminance.width, luminance.height);
  const auto base = static_cast<float>(kAxisCoupling / (reach_px * reach_px));
  const auto per_l = static_cast<float>(options.unlike_luminance * options.unlike_luminance);
  const auto per_ab = static_cast<float>(options.unlike_chroma * options.unlike_chroma);
  GridPlane screening(luminance.width, luminance.height);
  for (size_t i = 0; i < like.PlaneSize(); ++i) {
    const float mean = strokes.Plane(0)[i];
    const float variance = std::max(0.0f, strokes.Plane(1)[i] - mean * mean);
    const float l = like.Plane(0)[i] - mean;
    const float a = like.Plane(2)[i] - strokes.Plane(2)[i];
    const float b = like.Plane(3)[i] - strokes.Plane(3)[i];
    const float unlike = l * l / (per_l + variance) + (a * a + b * b) / per_ab;
    screening[static_cast<int64_t>(i)] = base * (1.0f + kScreeningOfUnlike * unlike);
  }
  return screening;
}

float ShareOfPull(float pull) {
  const float t = std::clamp((pull - kNoPull) / (kFullPull - kNoPull), 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

// The grid of a picture.
GridSystem LayerGrid(const Image& luminance, const LayerOptions& options, ThreadPool& pool) {
  return SystemOfLuminance(luminance, SigmaOfTexture(luminance, options), pool);
}

// The layer at the size of the map. The solution is linear in the pinned colours, so the pulled
// colours over the pull are their weighted mean.
HintLayer LayerAtSize(const Image& luminance,
                      const Image& below,
                      const HintMap& hints,
                      const LayerOptions& options,
                      const RunControl& control,
                      QuickGrid* prepared) {
  const GridPlane screening = Screening(luminance, below, hints, options);
  const size_t n = luminance.PlaneSize();
  std::vector<float> colors(2 * n, 0.0f), pulls(2 * n, 0.0f);
  for (size_t i = 0; i < n; ++i) {
    if (!hints.hinted[i] || hints.IsKept(i)) continue;
    colors[i] = hints.ab.Plane(0)[i];
    colors[i + n] = hints.ab.Plane(1)[i];
    pulls[i] = 1.0f;
  }
  std::optional<GridHierarchy> own;
  if (prepared == nullptr) {
    own.emplace(LayerGrid(luminance, options, control.pool), control.pool, CancellationToken());
  }
  // The data term holds all pixels but the pinned ones at 0.
  const auto solve = [&](const std::vector<float>& target) {
    if (!own) return prepared->Solve(hints.hinted, &screening, target, control.cancel);
    return own->Solve(
        hints.hinted,
        &screening,
        target,
        {options.tolerance, options.max_iterations},
        [&](int iteration, double) {
          control.progress.OnProgress(iteration, 0, "laying the strokes above the colours");
        },
        control.cancel);
  };
  const GridSolution color = solve(colors), pull = solve(pulls);
  HintLayer layer{Image(luminance.width, luminance.height, 2),
                  Image(luminance.width, luminance.height, 1),
                  0,
                  color.iterations + pull.iterations};
  for (size_t i = 0; i < n; ++i) {
    const float share = ShareOfPull(pull.u[i]);
    layer.share.data[i] = share;
    if (share <= 0.0f) continue;
    layer.ab.Plane(0)[i] = color.u[i] / pull.u[i];
    layer.ab.Plane(1)[i] = color.u[i + n] / pull.u[i];
  }
  return layer;
}

// The layer of a smaller picture at the size of `luminance`.
HintLayer Enlarge(const HintLayer& small, const Image& luminance) {
  Image weighted(small.share.width, small.share.height, 3);
  for (size_t i = 0; i < small.share.data.size(); ++i) {
    weighted.Plane(2)[i] = small.share.data[i];
    for (int c = 0; c < 2; ++c) weighted.Plane(c)[i] = small.share.data[i] * small.ab.Plane(c)[i];
  }
  weighted = UpsampleGuided(weighted, luminance);
  HintLayer layer{Image(luminance.width, luminance.height, 2),
                  Image(luminance.width, luminance.height, 1),
                  0,
                  small.iterations};
  for (size_t i = 0; i < layer.share.data.size(); ++i) {
    const float share = std::clamp(weighted.Plane(2)[i], 0.0f, 1.0f);
    if (share < 1.0f / 255.0f) continue;
    layer.share.data[i] = share;
    for (int c = 0; c < 2; ++c) layer.ab.Plane(c)[i] = weighted.Plane(c)[i] / share;
  }
  return layer;
}

void SetHintedPixels(const HintMap& hints, HintLayer* layer) {
  for (size_t i = 0; i < hints.hinted.size(); ++i) {
    if (!hints.hinted[i]) continue;
    ++layer->hinted_pixels;
    layer->share.data[i] = hints.IsKept(i) ? 0.0f : 1.0f;
    for (int c = 0; c < 2; ++c) layer->ab.Plane(c)[i] = hints.ab.Plane(c)[i];
  }
}

}  // namespace

void LayerOptions::Validate() const {
  const RangeCheck check("layer option");
  check("sigma", sigma, 0.1, 50.0);
  check("texture", texture, 0.0, 20.0);
  check("reach", reach, 0.005, 1.0);
  check("unlike_luminance", unlike_luminance, 0.1, 1000.0);
  check("unlike_chroma", unlike_chroma, 0.1, 1000.0);
  check("max_side_px", max_side_px, 64, 16384);
  check("tolerance", tolerance, 1e-6, 0.1);
  check("max_iterations", max_iterations, 1, 1000000);
}

HintLayer LayerOfHints(const Image& luminance,
                       const Image& below,
                       const std::vector<ColorHint>& hints,
                       const LayerOptions& options,
                       const RunControl& control,
                       const HintPictures& pictures,
                       QuickGrid* prepared) {
  options.Validate();
  RequireFiniteLuminance(luminance, "the strokes above other colours");
  HintPictures above = pictures;
  above.automatic_ab = &below;
  HintMap map =
      DrawHints(hints, above, luminance.width, luminance.height, control.progress, control.cancel);
  HintLayer layer;
  if (std::max(luminance.width, luminance.height) <= options.max_side_px) {
    layer = LayerAtSize(luminance, below, map, options, control, prepared);
  } else {
    const Image small = FitWithin(luminance, options.max_side_px);
    layer = Enlarge(LayerAtSize(small,
                                Resize(below, small.width, small.height),
                                ReduceHints(map, small.width, small.height),
                                options,
                                control,
                                prepared),
                    luminance);
  }
  SetHintedPixels(map, &layer);
  return layer;
}

std::shared_ptr<QuickGrid> PrepareLayer(const Image& luminance,
                                        const LayerOptions& options,
                                        ThreadPool& pool) {
  return std::make_shared<QuickGrid>(
      LayerGrid(FitWithin(luminance, options.max_side_px), options, pool),
      kLayerHalvings,
      pool,
      CancellationToken());
}

void LayAbove(const HintLayer& layer, Image* below) {
  for (int c = 0; c < 2; ++c) {
    for (size_t i = 0; i < layer.share.data.size(); ++i) {
      float& value = below->Plane(c)[i];
      const float share = layer.share.data[i];
      if (share > 0.0f) value += share * (layer.ab.Plane(c)[i] - value);
    }
  }
}

}  // namespace color3d
