#include "core/splat/chroma/chroma_system.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/splat/model/spherical_harmonics.h"

namespace color3d {
namespace {

constexpr int kTileFloats = 2 * kTilePixels;  // of a tile's picture

// Copies a tile's targets and weights; pixels outside, and those of weight 0, get zeros. `sure`
// gets weights in its first channel, weights times confidence in its second.
void LoadTile(const PlaneBuffer& ab,
              const PlaneBuffer& weight,
              const PlaneBuffer& confidence,
              int x0,
              int y0,
              float* target,
              float* mask,
              float* sure) {
  for (int b = 0; b < kTileBlocks; ++b) {
    for (int lane = 0; lane < kBlockPixels; ++lane) {
      const int x = x0 + PixelX(b, lane), y = y0 + PixelY(b, lane);
      const bool inside = x < ab.width && y < ab.height;
      const float w = inside ? weight.Row(0, y)[x] : 0.0f;
      float* t = target + 2 * kBlockPixels * b + lane;
      t[0] = w > 0.0f ? ab.Row(0, y)[x] : 0.0f;
      t[kBlockPixels] = w > 0.0f ? ab.Row(1, y)[x] : 0.0f;
      mask[kBlockPixels * b + lane] = w > 0.0f ? w : 0.0f;
      float* s = sure + 2 * kBlockPixels * b + lane;
      s[0] = w > 0.0f ? w : 0.0f;
      s[kBlockPixels] = w > 0.0f ? w * confidence.Row(0, y)[x] : 0.0f;
    }
  }
}

// D of a tile from the residuals target - picture, which become `picture`. Returns the sums of
// weight * |residual| and of the weights.
std::array<float, 2> WeighTile(
    const RobustWeights& robust, const float* target, const float* mask, float* picture, float* d) {
  const float scale = static_cast<float>(robust.scale), floor = static_cast<float>(robust.floor);
  float l1 = 0.0f, area = 0.0f;
  for (int b = 0; b < 2 * kTileBlocks; ++b) {
    const float* m = mask + b / 2 * kBlockPixels;
    for (int lane = 0; lane < kBlockPixels; ++lane) {
      const int i = b * kBlockPixels + lane;
      const float r = target[i] - picture[i];
      l1 += m[lane] * std::abs(r);
      area += m[lane];
      d[i] = robust.on ? m[lane] * scale / std::max(std::abs(r), floor) : m[lane];
      picture[i] = r;
    }
  }
  return {l1, area};
}

}  // namespace

// Targets and D are [tile][block][channel][16], pixel weights [tile][block][16].
struct ChromaSystem::View {
  RasterCamera camera;
  double time_s = 0.0;
  int tiles = 0;
  bool kept = false;
  std::vector<TileWeights> weights;  // per tile, when kept
  AlignedFloats target, mask, d;

  float* Target(int tile) { return target.data() + static_cast<size_t>(tile) * kTileFloats; }
  float* Mask(int tile) { return mask.data() + static_cast<size_t>(tile) * kTilePixels; }
  float* D(int tile) { return d.data() + static_cast<size_t>(tile) * kTileFloats; }
};

ChromaSystem::ChromaSystem(const ParameterBlock& parameters,
                           const ColorSpec& color,
                           GeometryInTime& in_time,
                           int64_t budget_bytes,
                           ThreadPool& pool)
    : parameters_(parameters),
      color_(color),
      in_time_(in_time),
      at_(&parameters),
      coefficients_(color.channel[0].coefficients),
      budget_bytes_(budget_bytes),
      pool_(pool) {
  seen_weight_.assign(count(), 0.0);
  target_sum_.assign(2 * count(), 0.0);
  confidence_sum_.assign(count(), 0.0);
  pixel_sums_.resize(pool.thread_count());
}

ChromaSystem::~ChromaSystem() = default;

void ChromaSystem::ResetSums(Sums& sums) const {
  sums.resize(pool_.thread_count());
  for (AlignedFloats& s : sums) s.assign(2 * static_cast<size_t>(count()), 0.0f);
}

void ChromaSystem::BinView(const RasterCamera& camera) {
  ProjectSplats(*at_, color_, false, camera, pool_, splats_);
  binner_.Bin(splats_, camera.width, camera.height, pool_, lists_);
}

void ChromaSystem::AddView(const RasterCamera& camera,
                           double time_s,
                           const PlaneBuffer& ab,
                           const PlaneBuffer& weight,
                           const PlaneBuffer& confidence,
                           bool keep) {
  auto view = std::make_unique<View>();
  view->camera = camera;
  view->time_s = time_s;
  Enter(time_s);
  BinView(camera);
  view->tiles = lists_.tile_count();
  view->target.resize(static_cast<size_t>(view->tiles) * kTileFloats);
  view->mask.resize(static_cast<size_t>(view->tiles) * kTilePixels);
  view->kept = keep && kept_bytes_ < budget_bytes_;
  if (view->kept) view->weights.resize(view->tiles);
  ResetSums(sums_);
  ResetSums(right_);
  const int threads = pool_.thread_count();
  pool_.ForRanges(threads, [&](int64_t thread, int64_t, int) {
    TileWeights w;
    alignas(64) float picture[kTileFloats], sure[kTileFloats];
    for (int tile = static_cast<int>(thread); tile < view->tiles; tile += threads) {
      const float* target = view->Target(tile);
      const float* mask = view->Mask(tile);
      LoadTile(ab,
               weight,
               confidence,
               tile % lists_.tiles_x * kTileSide,
               tile / lists_.tiles_x * kTileSide,
               view->Target(tile),
               view->Mask(tile),
               sure);
      BuildTileWeights(splats_, lists_, tile, camera.width, camera.height, w);
      for (int i = 0; i < kTileFloats; ++i) {
        picture[i] = mask[i / (2 * kBlockPixels) * kBlockPixels + i % kBlockPixels] * target[i];
      }
      TileAdjoint(w, picture, sums_[thread].data());
      TileAdjoint(w, sure, right_[thread].data());
      if (view->kept) view->weights[tile] = w;
    }
  });
  for (int64_t i = 0; i < count(); ++i) {
    for (int t = 0; t < threads; ++t) {
      seen_weight_[i] += right_[t][2 * i];
      confidence_sum_[i] += right_[t][2 * i + 1];
      target_sum_[2 * i] += sums_[t][2 * i];
      target_sum_[2 * i + 1] += sums_[t][2 * i + 1];
    }
  }
  if (!keep) return;
  for (const TileWeights& w : view->weights) kept_bytes_ += w.Bytes();
  view->d.assign(view->target.size(), 0.0f);
  views_.push_back(std::move(view));
}

// visit(tile, thread, weights) for every tile; a thread's tiles are always the same.
template <class Visitor>
void ChromaSystem::ForTiles(View& view, const Visitor& visit) {
  if (!view.kept) BinView(view.camera);
  const int threads = pool_.thread_count();
  pool_.ForRanges(threads, [&](int64_t thread, int64_t, int) {
    TileWeights made;
    for (int tile = static_cast<int>(thread); tile < view.tiles; tile += threads) {
      if (!view.kept) {
        BuildTileWeights(splats_, lists_, tile, view.camera.width, view.camera.height, made);
      }
      visit(tile, static_cast<int>(thread), view.kept ? view.weights[tile] : made);
    }
  });
}

void ChromaSystem::Basis(const RasterCamera& camera, int64_t i, float* basis) const {
  float d[3], square = 0.0f;
  for (int k = 0; k < 3; ++k) {
    d[k] = at_->Row(kPositionRow + k)[i] - camera.center[k];
    square += d[k] * d[k];
  }
  const float inverse = square > 0.0f ? 1.0f / std::sqrt(square) : 0.0f;
  EvaluateSh(coefficients_, d[0] * inverse, d[1] * inverse, d[2] * inverse, basis);
}

void ChromaSystem::SetValues(const RasterCamera& camera, const ChromaVector& x) {
  value_.resize(2 * static_cast<size_t>(count()));
  pool_.ForRanges(count(), [&](int64_t begin, int64_t end, int) {
    float basis[kMaxShCoefficients];
    if (coefficients_ == 1) EvaluateSh(1, 0.0f, 0.0f, 1.0f, basis);
    for (int64_t i = begin; i < end; ++i) {
      if (coefficients_ > 1) Basis(camera, i, basis);
      double a = 0.0, b = 0.0;
      for (int k = 0; k < coefficients_; ++k) {
        a += basis[k] * x[(i * coefficients_ + k) * 2];
        b += basis[k] * x[(i * coefficients_ + k) * 2 + 1];
      }
      value_[2 * i] = static_cast<float>(a);
      value_[2 * i + 1] = static_cast<float>(b);
    }
  });
}

ChromaSystem::PixelSums ChromaSystem::SumOfThreads() {
  PixelSums sum;
  for (PixelSums& s : pixel_sums_) {
    sum.l1 += s.l1;
    sum.weight += s.weight;
    s = {};
  }
  return sum;
}

// y += Y^T (sums over the threads), and the sums are zero again.
void ChromaSystem::AddSums(const RasterCamera& camera, Sums& sums, ChromaVector& y) {
  pool_.ForRanges(count(), [&](int64_t begin, int64_t end, int) {
    float basis[kMaxShCoefficients];
    if (coefficients_ == 1) EvaluateSh(1, 0.0f, 0.0f, 1.0f, basis);
    for (int64_t i = begin; i < end; ++i) {
      double a = 0.0, b = 0.0;
      for (AlignedFloats& s : sums) {
        a += s[2 * i];
        b += s[2 * i + 1];
        s[2 * i] = s[2 * i + 1] = 0.0f;
      }
      if (a == 0.0 && b == 0.0) continue;
      if (coefficients_ > 1) Basis(camera, i, basis);
      for (int k = 0; k < coefficients_; ++k) {
        y[(i * coefficients_ + k) * 2] += basis[k] * a;
        y[(i * coefficients_ + k) * 2 + 1] += basis[k] * b;
      }
    }
  });
}

void ChromaSystem::AddBlocks(const RasterCamera& camera, std::vector<double>& blocks) {
  const int n = coefficients_;
  pool_.ForRanges(count(), [&](int64_t begin, int64_t end, int) {
    float basis[kMaxShCoefficients];
    if (n == 1) EvaluateSh(1, 0.0f, 0.0f, 1.0f, basis);
    for (int64_t i = begin; i < end; ++i) {
      double sum[2] = {0.0, 0.0};
      for (AlignedFloats& s : squares_) {
        for (int c = 0; c < 2; ++c) {
          sum[c] += s[2 * i + c];
          s[2 * i + c] = 0.0f;
        }
      }
      if (sum[0] == 0.0 && sum[1] == 0.0) continue;
      if (n > 1) Basis(camera, i, basis);
      for (int c = 0; c < 2; ++c) {
        double* block = blocks.data() + (i * 2 + c) * n * n;
        for (int k = 0; k < n; ++k) {
          for (int l = 0; l < n; ++l) block[k * n + l] += sum[c] * basis[k] * basis[l];
        }
      }
    }
  });
}

// x += relaxation * sums / B, and the sums are zero again.
void ChromaSystem::Step(const RasterCamera& camera,
                        double relaxation,
                        double rest_weight,
                        const std::vector<char>& seen,
                        ChromaVector& x) {
  const int n = coefficients_;
  const double per_view = 1.0 / static_cast<double>(views_.size());
  pool_.ForRanges(count(), [&](int64_t begin, int64_t end, int) {
    float basis[kMaxShCoefficients];
    EvaluateSh(1, 0.0f, 0.0f, 1.0f, basis);
    for (int64_t i = begin; i < end; ++i) {
      double sum[2] = {0.0, 0.0}, row[2] = {0.0, 0.0};
      for (size_t t = 0; t < sums_.size(); ++t) {
        for (int c = 0; c < 2; ++c) {
          sum[c] += sums_[t][2 * i + c];
          row[c] += right_[t][2 * i + c];
          sums_[t][2 * i + c] = right_[t][2 * i + c] = 0.0f;
        }
      }
      if (seen[i] == 0 || (row[0] == 0.0 && row[1] == 0.0)) continue;
      if (n > 1) Basis(camera, i, basis);
      double norm = basis[0] * basis[0];
      for (int k = 1; k < n; ++k) norm += rest_weight * basis[k] * basis[k];
      for (int c = 0; c < 2; ++c) {
        const double b = norm * std::max(row[c], per_view * seen_weight_[i]);
        if (!(b > 0.0)) continue;
        for (int k = 0; k < n; ++k) {
          x[(i * n + k) * 2 + c] +=
              relaxation * (k == 0 ? 1.0 : rest_weight) * basis[k] * sum[c] / b;
        }
      }
    }
  });
}

double ChromaSystem::Sweep(const RobustWeights& robust,
                           double relaxation,
                           double rest_weight,
                           const std::vector<char>& seen,
                           const CancellationToken& cancel,
                           ChromaVector& x) {
  ResetSums(sums_);
  ResetSums(right_);
  // Views in the order of a path would drag the colours along it: a stride that is coprime to their
  // number mixes them.
  const size_t n = views_.size();
  size_t stride = std::max<size_t>(1, static_cast<size_t>(0.618 * static_cast<double>(n)));
  while (std::gcd(stride, n) > 1) ++stride;
  for (size_t k = 0; k < n; ++k) {
    cancel.ThrowIfCancelled();
    View& view = *views_[k * stride % n];
    Enter(view.time_s);
    SetValues(view.camera, x);
    ForTiles(view, [&](int tile, int thread, const TileWeights& weights) {
      alignas(64) float picture[kTileFloats];
      float* d = view.D(tile);
      TileForward(weights, value_.data(), picture);
      const auto [l1, area] = WeighTile(robust, view.Target(tile), view.Mask(tile), picture, d);
      for (int i = 0; i < kTileFloats; ++i) picture[i] *= d[i];
      pixel_sums_[thread].l1 += l1;
      pixel_sums_[thread].weight += area;
      TileAdjoint(weights, picture, sums_[thread].data());
      TileAdjoint(weights, d, right_[thread].data());
    });
    Step(view.camera, relaxation, rest_weight, seen, x);
  }
  return SumOfThreads().Mean();
}

void ChromaSystem::Reweight(const ChromaVector& x,
                            const RobustWeights& robust,
                            const CancellationToken& cancel,
                            Residuals& out) {
  out.gradient.assign(x.size(), 0.0);
  out.right.assign(x.size(), 0.0);
  out.blocks.assign(static_cast<size_t>(count()) * 2 * coefficients_ * coefficients_, 0.0);
  ResetSums(sums_);
  ResetSums(squares_);
  ResetSums(right_);
  for (const auto& view : views_) {
    cancel.ThrowIfCancelled();
    Enter(view->time_s);
    SetValues(view->camera, x);
    ForTiles(*view, [&](int tile, int thread, const TileWeights& weights) {
      alignas(64) float picture[kTileFloats], right[kTileFloats];
      const float* target = view->Target(tile);
      float* d = view->D(tile);
      TileForward(weights, value_.data(), picture);
      const auto [l1, area] = WeighTile(robust, target, view->Mask(tile), picture, d);
      for (int i = 0; i < kTileFloats; ++i) {
        picture[i] *= d[i];
        right[i] = d[i] * target[i];
      }
      pixel_sums_[thread].l1 += l1;
      pixel_sums_[thread].weight += area;
      TileAdjoint(weights, picture, sums_[thread].data());
      TileAdjoint(weights, right, right_[thread].data());
      TileSquares(weights, d, squares_[thread].data());
    });
    AddSums(view->camera, sums_, out.gradient);
    AddSums(view->camera, right_, out.right);
    AddBlocks(view->camera, out.blocks);
  }
  out.mean_l1 = SumOfThreads().Mean();
}

void ChromaSystem::Multiply(const ChromaVector& x,
                            const CancellationToken& cancel,
                            ChromaVector& y) {
  y.assign(x.size(), 0.0);
  ResetSums(sums_);
  for (size_t k = 0; k < views_.size(); ++k) {
    View& view = *views_[k];
    cancel.ThrowIfCancelled();
    Enter(view.time_s);
    // Values of degree 0 are the same for all views.
    if (k == 0 || coefficients_ > 1) SetValues(view.camera, x);
    ForTiles(view, [&](int tile, int thread, const TileWeights& weights) {
      alignas(64) float picture[kTileFloats];
      const float* d = view.D(tile);
      TileForward(weights, value_.data(), picture);
      for (int i = 0; i < kTileFloats; ++i) picture[i] *= d[i];
      TileAdjoint(weights, picture, sums_[thread].data());
    });
    AddSums(view.camera, sums_, y);
  }
}

}  // namespace color3d
