#include "core/splat/chroma/chroma_system.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

#include "core/splat/model/spherical_harmonics.h"

namespace color3d {

// Targets and D are [tile][block][channel][16], pixel weights [tile][block][16].
struct ChromaSystem::View {
  PosedCamera posed;
  RasterCamera camera;
  int tiles = 0;
  bool kept = false;                 // all below
  std::vector<TileWeights> weights;  // per tile
  AlignedFloats target, mask, d;

  void Allocate() {
    weights.resize(tiles);
    target.resize(static_cast<size_t>(tiles) * kTileFloats);
    mask.resize(static_cast<size_t>(tiles) * kTilePixels);
    d.assign(target.size(), 0.0f);
  }
  void Release() {
    kept = false;
    weights = std::vector<TileWeights>();  // {} would keep the memory
    target = AlignedFloats();
    mask = AlignedFloats();
    d = AlignedFloats();
  }
  // Size of the allocation, used or not.
  int64_t Bytes() const {
    auto bytes =
        static_cast<int64_t>(sizeof(float) * (target.capacity() + mask.capacity() + d.capacity()));
    for (const TileWeights& w : weights) bytes += w.Bytes();
    return bytes;
  }
  float* Target(int tile) { return target.data() + static_cast<size_t>(tile) * kTileFloats; }
  float* Mask(int tile) { return mask.data() + static_cast<size_t>(tile) * kTilePixels; }
  float* D(int tile) { return d.data() + static_cast<size_t>(tile) * kTileFloats; }
};

struct ChromaSystem::Tile {
  const TileWeights& weights;
  const float* target;
  const float* mask;
  float* d;
};

ChromaSystem::ChromaSystem(const ParameterBlock& parameters,
                           const ColorSpec& color,
                           GeometryInTime& in_time,
                           ChromaTargets& targets,
                           int64_t budget_bytes,
                           ThreadPool& pool)
    : parameters_(parameters),
      color_(color),
      in_time_(in_time),
      targets_(targets),
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
  ProjectSplats({*at_, color_, camera}, false, pool_, splats_);
  binner_.Bin(splats_, camera.width, camera.height, pool_, lists_);
}

bool ChromaSystem::AddView(const PosedCamera& posed, const ChromaPlanes& planes, bool solve) {
  auto view = std::make_unique<View>();
  view->posed = posed;
  view->camera = MakeRasterCamera(posed.camera, posed.cam_from_world);
  const RasterCamera& camera = view->camera;
  Enter(posed.time_s);
  BinView(camera);
  view->tiles = lists_.tile_count();
  view->kept = solve && !is_full_;
  if (view->kept) view->Allocate();
  ResetSums(sums_);
  ResetSums(right_);
  const int threads = pool_.thread_count();
  pool_.ForRanges(threads, [&](int64_t thread, int64_t, int) {
    TileWeights w;
    alignas(64) float target[kTileFloats], mask[kTilePixels];
    alignas(64) float picture[kTileFloats], sure[kTileFloats];
    for (int tile = static_cast<int>(thread); tile < view->tiles; tile += threads) {
      const int x0 = tile % lists_.tiles_x * kTileSide, y0 = tile / lists_.tiles_x * kTileSide;
      LoadTile(planes, x0, y0, target, mask);
      LoadConfidence(planes.confidence, x0, y0, mask, sure);
      BuildTileWeights(splats_, lists_, tile, camera.width, camera.height, w);
      for (int i = 0; i < kTileFloats; ++i) {
        picture[i] = mask[i / (2 * kBlockPixels) * kBlockPixels + i % kBlockPixels] * target[i];
      }
      TileAdjoint(w, picture, sums_[thread].data());
      TileAdjoint(w, sure, right_[thread].data());
      if (!view->kept) continue;
      view->weights[tile] = w;
      std::copy_n(target, kTileFloats, view->Target(tile));
      std::copy_n(mask, kTilePixels, view->Mask(tile));
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
  return solve && Keep(std::move(view));
}

bool ChromaSystem::Keep(std::unique_ptr<View> view) {
  const bool fits = view->kept && kept_bytes() + view->Bytes() <= budget_bytes_;
  if (!fits) {
    is_full_ = true;
    view->Release();
  }
  views_.push_back(std::move(view));
  return fits;
}

int64_t ChromaSystem::kept_bytes() const {
  int64_t bytes = 0;
  for (const auto& view : views_) bytes += view->Bytes();
  return bytes;
}

// Calls visit(view, planes) for every view, the k-th of them order(k). `planes`: the targets of a
// view that is not cached; several views are read concurrently.
template <class Order, class Visitor>
void ChromaSystem::ForViews(const CancellationToken& cancel,
                            const Order& order,
                            const Visitor& visit) {
  const size_t n = views_.size(), at_once = static_cast<size_t>(pool_.thread_count());
  std::vector<std::shared_ptr<const ChromaPlanes>> planes(at_once);
  for (size_t begin = 0; begin < n; begin += at_once) {
    const size_t size = std::min(at_once, n - begin);
    pool_.ForEach(static_cast<int64_t>(size), [&](int64_t i, int) {
      const View& view = *views_[order(begin + static_cast<size_t>(i))];
      planes[i] = view.kept ? nullptr : targets_.Get(view.posed);
    });
    for (size_t i = 0; i < size; ++i) {
      cancel.ThrowIfCancelled();
      View& view = *views_[order(begin + i)];
      Enter(view.posed.time_s);
      visit(view, planes[i].get());
    }
  }
}

// Calls visit(thread, tile) for every tile; the assignment of tiles to threads is fixed.
template <class Visitor>
void ChromaSystem::ForTiles(View& view, const ChromaPlanes* planes, const Visitor& visit) {
  if (!view.kept) BinView(view.camera);
  const int threads = pool_.thread_count();
  pool_.ForRanges(threads, [&](int64_t thread, int64_t, int) {
    TileWeights made;
    alignas(64) float target[kTileFloats], mask[kTilePixels], d[kTileFloats];
    for (int i = static_cast<int>(thread); i < view.tiles; i += threads) {
      if (view.kept) {
        visit(static_cast<int>(thread),
              Tile{view.weights[i], view.Target(i), view.Mask(i), view.D(i)});
        continue;
      }
      LoadTile(
          *planes, i % lists_.tiles_x * kTileSide, i / lists_.tiles_x * kTileSide, target, mask);
      BuildTileWeights(splats_, lists_, i, view.camera.width, view.camera.height, made);
      visit(static_cast<int>(thread), Tile{made, target, mask, d});
    }
  });
}

void ChromaSystem::Basis(const RasterCamera& camera, int64_t i, float* basis) const {
  if (coefficients_ == 1) return EvaluateSh(1, 0.0f, 0.0f, 1.0f, basis);
  float d[3], square = 0.0f;
  for (int k = 0; k < 3; ++k) {
    d[k] = at_->Row(kPositionRow + k)[i] - camera.center[k];
    square += d[k] * d[k];
  }
  const float inverse = square > 0.0f ? 1.0f / std::sqrt(square) : 0.0f;
  EvaluateSh(coefficients_, d[0] * inverse, d[1] * inverse, d[2] * inverse, basis);
}

void ChromaSystem::SetValues(const RasterCamera& camera,
                             const ChromaVector& x,
                             AlignedFloats& value) {
  value.resize(2 * static_cast<size_t>(count()));
  pool_.ForRanges(count(), [&](int64_t begin, int64_t end, int) {
    float basis[kMaxShCoefficients];
    for (int64_t i = begin; i < end; ++i) {
      Basis(camera, i, basis);
      double a = 0.0, b = 0.0;
      for (int k = 0; k < coefficients_; ++k) {
        a += basis[k] * x[(i * coefficients_ + k) * 2];
        b += basis[k] * x[(i * coefficients_ + k) * 2 + 1];
      }
      value[2 * i] = static_cast<float>(a);
      value[2 * i + 1] = static_cast<float>(b);
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

// y += Y^T (sums over the threads), and resets the sums to zero.
void ChromaSystem::AddSums(const RasterCamera& camera, Sums& sums, ChromaVector& y) {
  pool_.ForRanges(count(), [&](int64_t begin, int64_t end, int) {
    float basis[kMaxShCoefficients];
    for (int64_t i = begin; i < end; ++i) {
      double a = 0.0, b = 0.0;
      for (AlignedFloats& s : sums) {
        a += s[2 * i];
        b += s[2 * i + 1];
        s[2 * i] = s[2 * i + 1] = 0.0f;
      }
      if (a == 0.0 && b == 0.0) continue;
      Basis(camera, i, basis);
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
    for (int64_t i = begin; i < end; ++i) {
      double sum[2] = {0.0, 0.0};
      for (AlignedFloats& s : squares_) {
        for (int c = 0; c < 2; ++c) {
          sum[c] += s[2 * i + c];
          s[2 * i + c] = 0.0f;
        }
      }
      if (sum[0] == 0.0 && sum[1] == 0.0) continue;
      Basis(camera, i, basis);
      for (int c = 0; c < 2; ++c) {
        double* block = blocks.data() + (i * 2 + c) * n * n;
        for (int k = 0; k < n; ++k) {
          for (int l = 0; l < n; ++l) block[k * n + l] += sum[c] * basis[k] * basis[l];
        }
      }
    }
  });
}

// x += relaxation * sums / B, and resets the sums to zero.
void ChromaSystem::Step(const RasterCamera& camera,
                        double relaxation,
                        double rest_weight,
                        const std::vector<char>& seen,
                        ChromaVector& x) {
  const int n = coefficients_;
  const double per_view = 1.0 / static_cast<double>(views_.size());
  pool_.ForRanges(count(), [&](int64_t begin, int64_t end, int) {
    float basis[kMaxShCoefficients];
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
      Basis(camera, i, basis);
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
  // Sweeping views in the order of a path would drag colours along it: a stride coprime to their
  // number mixes them.
  const size_t n = views_.size();
  size_t stride = std::max<size_t>(1, static_cast<size_t>(0.618 * static_cast<double>(n)));
  while (std::gcd(stride, n) > 1) ++stride;
  const auto order = [&](size_t k) { return k * stride % n; };
  ForViews(cancel, order, [&](View& view, const ChromaPlanes* planes) {
    SetValues(view.camera, x, value_);
    ForTiles(view, planes, [&](int thread, const Tile& tile) {
      alignas(64) float picture[kTileFloats];
      TileForward(tile.weights, value_.data(), picture);
      const auto [l1, area] = WeighTile(robust, tile.target, tile.mask, picture, tile.d);
      for (int i = 0; i < kTileFloats; ++i) picture[i] *= tile.d[i];
      pixel_sums_[thread].l1 += l1;
      pixel_sums_[thread].weight += area;
      TileAdjoint(tile.weights, picture, sums_[thread].data());
      TileAdjoint(tile.weights, tile.d, right_[thread].data());
    });
    Step(view.camera, relaxation, rest_weight, seen, x);
  });
  return SumOfThreads().Mean();
}

void ChromaSystem::Reweight(const ChromaVector& x,
                            const RobustWeights& robust,
                            const CancellationToken& cancel,
                            Residuals& out) {
  robust_ = robust;
  weighed_at_ = x;
  out.gradient.assign(x.size(), 0.0);
  out.right.assign(x.size(), 0.0);
  out.blocks.assign(static_cast<size_t>(count()) * 2 * coefficients_ * coefficients_, 0.0);
  ResetSums(sums_);
  ResetSums(squares_);
  ResetSums(right_);
  ForViews(cancel, std::identity(), [&](View& view, const ChromaPlanes* planes) {
    SetValues(view.camera, x, value_);
    ForTiles(view, planes, [&](int thread, const Tile& tile) {
      alignas(64) float picture[kTileFloats], right[kTileFloats];
      TileForward(tile.weights, value_.data(), picture);
      const auto [l1, area] = WeighTile(robust, tile.target, tile.mask, picture, tile.d);
      for (int i = 0; i < kTileFloats; ++i) {
        picture[i] *= tile.d[i];
        right[i] = tile.d[i] * tile.target[i];
      }
      pixel_sums_[thread].l1 += l1;
      pixel_sums_[thread].weight += area;
      TileAdjoint(tile.weights, picture, sums_[thread].data());
      TileAdjoint(tile.weights, right, right_[thread].data());
      TileSquares(tile.weights, tile.d, squares_[thread].data());
    });
    AddSums(view.camera, sums_, out.gradient);
    AddSums(view.camera, right_, out.right);
    AddBlocks(view.camera, out.blocks);
  });
  out.mean_l1 = SumOfThreads().Mean();
}

void ChromaSystem::Multiply(const ChromaVector& x,
                            const CancellationToken& cancel,
                            ChromaVector& y) {
  y.assign(x.size(), 0.0);
  ResetSums(sums_);
  // Values of degree 0 are the same for all views.
  bool has_values = false, has_weighed_values = false;
  ForViews(cancel, std::identity(), [&](View& view, const ChromaPlanes* planes) {
    if (!has_values) SetValues(view.camera, x, value_);
    has_values = coefficients_ == 1;
    if (!view.kept && !has_weighed_values) {
      SetValues(view.camera, weighed_at_, weighed_value_);
      has_weighed_values = coefficients_ == 1;
    }
    ForTiles(view, planes, [&](int thread, const Tile& tile) {
      alignas(64) float picture[kTileFloats];
      if (!view.kept) {
        TileForward(tile.weights, weighed_value_.data(), picture);
        WeighTile(robust_, tile.target, tile.mask, picture, tile.d);
      }
      TileForward(tile.weights, value_.data(), picture);
      for (int i = 0; i < kTileFloats; ++i) picture[i] *= tile.d[i];
      TileAdjoint(tile.weights, picture, sums_[thread].data());
    });
    AddSums(view.camera, sums_, y);
  });
}

}  // namespace color3d
