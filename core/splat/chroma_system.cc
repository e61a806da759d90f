#include "core/splat/chroma_system.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/splat/spherical_harmonics.h"

namespace color3d {
namespace {

constexpr int BlocksOf(ChromaLevel level) { return level == ChromaLevel::kFine ? kFineBlocks : 1; }

}  // namespace

// Targets and D are [tile][block][channel][16], pixel weights [tile][block][16].
struct ChromaSystem::View {
  RasterCamera camera;
  int tiles = 0;
  struct Cells {
    bool kept = false;
    std::vector<TileWeights> weights;  // per tile, when kept
    AlignedFloats target, mask, d;
  };
  Cells level[2];
  Cells& At(ChromaLevel l) { return level[static_cast<int>(l)]; }

  void LoadPixels(const PlaneBuffer& ab, const PlaneBuffer& weight, int tiles_x);
  void Coarsen();
};

void ChromaSystem::View::LoadPixels(const PlaneBuffer& ab, const PlaneBuffer& weight, int tiles_x) {
  Cells& fine = At(ChromaLevel::kFine);
  fine.target.assign(static_cast<size_t>(tiles) * 2 * kTilePixels, 0.0f);
  fine.mask.assign(static_cast<size_t>(tiles) * kTilePixels, 0.0f);
  for (int tile = 0; tile < tiles; ++tile) {
    const int x0 = tile % tiles_x * kTileSide, y0 = tile / tiles_x * kTileSide;
    for (int i = 0; i < kTilePixels; ++i) {
      const int b = i / kBlockCells, lane = i % kBlockCells;
      const int x = x0 + FineX(b, lane), y = y0 + FineY(b, lane);
      if (x >= ab.width || y >= ab.height) continue;
      const float w = weight.Row(0, y)[x];
      if (w == 0.0f) continue;
      float* t = fine.target.data() + 2 * (static_cast<size_t>(tile) * kTilePixels) +
                 2 * kBlockCells * b + lane;
      t[0] = ab.Row(0, y)[x];
      t[kBlockCells] = ab.Row(1, y)[x];
      fine.mask[static_cast<size_t>(tile) * kTilePixels + i] = w;
    }
  }
}

void ChromaSystem::View::Coarsen() {
  const Cells& fine = At(ChromaLevel::kFine);
  Cells& coarse = At(ChromaLevel::kCoarse);
  coarse.target.assign(static_cast<size_t>(tiles) * 2 * kBlockCells, 0.0f);
  coarse.mask.assign(static_cast<size_t>(tiles) * kBlockCells, 0.0f);
  for (size_t block = 0; block < static_cast<size_t>(tiles) * kFineBlocks; ++block) {
    const float* mask = fine.mask.data() + kBlockCells * block;
    const float* target = fine.target.data() + 2 * kBlockCells * block;
    float total = 0.0f, a = 0.0f, b = 0.0f;
    for (int lane = 0; lane < kBlockCells; ++lane) {
      total += mask[lane];
      a += mask[lane] * target[lane];
      b += mask[lane] * target[kBlockCells + lane];
    }
    if (!(total > 0.0f)) continue;
    const size_t tile = block / kFineBlocks, cell = block % kFineBlocks;
    coarse.mask[kBlockCells * tile + cell] = total;
    coarse.target[2 * kBlockCells * tile + cell] = a / total;
    coarse.target[2 * kBlockCells * tile + kBlockCells + cell] = b / total;
  }
}

ChromaSystem::ChromaSystem(const ParameterBlock& parameters,
                           const ColorSpec& color,
                           int64_t budget_bytes,
                           ThreadPool& pool)
    : parameters_(parameters),
      color_(color),
      coefficients_(color.channel[0].coefficients),
      budget_bytes_(budget_bytes),
      pool_(pool) {
  seen_weight_.assign(count(), 0.0);
  target_sum_.assign(2 * count(), 0.0);
}

ChromaSystem::~ChromaSystem() = default;
std::string ChromaSystem::Debug() const {
  size_t e[2] = {}, it[2] = {};
  for (auto& v : views_)
    for (int l = 0; l < 2; ++l)
      for (auto& w : v->level[l].weights) {
        e[l] += w.gaussian.size();
        it[l] += w.items.size();
      }
  return std::to_string(views_.size()) + " views, coarse entries " +
         std::to_string(e[0] / views_.size()) + " fine " + std::to_string(e[1] / views_.size()) +
         " items " + std::to_string(it[1] / views_.size());
}

int ChromaSystem::kept_views(ChromaLevel level) const {
  int kept = 0;
  for (const auto& view : views_) kept += view->At(level).kept ? 1 : 0;
  return kept;
}

void ChromaSystem::ResetSums(std::vector<AlignedFloats>& sums) const {
  sums.resize(pool_.thread_count());
  for (AlignedFloats& s : sums) s.assign(2 * static_cast<size_t>(count()), 0.0f);
}

void ChromaSystem::BinView(const RasterCamera& camera) {
  ProjectSplats(parameters_, color_, false, camera, pool_, splats_);
  binner_.Bin(splats_, camera.width, camera.height, pool_, lists_);
}

void ChromaSystem::AddView(const RasterCamera& camera,
                           const PlaneBuffer& ab,
                           const PlaneBuffer& weight,
                           bool keep) {
  auto view = std::make_unique<View>();
  view->camera = camera;
  BinView(camera);
  view->tiles = lists_.tile_count();
  view->LoadPixels(ab, weight, lists_.tiles_x);
  view->Coarsen();
  View::Cells& fine = view->At(ChromaLevel::kFine);
  View::Cells& coarse = view->At(ChromaLevel::kCoarse);
  fine.weights.resize(keep ? view->tiles : 0);
  coarse.weights.resize(keep ? view->tiles : 0);
  ResetSums(sums_);
  ResetSums(right_);
  const int64_t threads = pool_.thread_count();
  pool_.ForRanges(threads, [&](int64_t thread, int64_t, int) {
    TileWeights scratch;
    float picture[2 * kTilePixels], ones[2 * kTilePixels];
    for (int tile = static_cast<int>(thread); tile < view->tiles;
         tile += static_cast<int>(threads)) {
      TileWeights& w = keep ? fine.weights[tile] : scratch;
      BuildTileWeights(splats_, lists_, tile, camera.width, camera.height, w);
      const float* mask = fine.mask.data() + static_cast<size_t>(tile) * kTilePixels;
      const float* target = fine.target.data() + static_cast<size_t>(tile) * 2 * kTilePixels;
      for (int i = 0; i < 2 * kTilePixels; ++i) {
        const float m = mask[i / (2 * kBlockCells) * kBlockCells + i % kBlockCells];
        picture[i] = m * target[i];
        ones[i] = m;
      }
      TileAdjoint(w, picture, sums_[thread].data());
      TileAdjoint(w, ones, right_[thread].data());
      if (keep) CoarsenTileWeights(w, mask, coarse.weights[tile]);
    }
  });
  for (int64_t i = 0; i < count(); ++i) {
    for (int64_t t = 0; t < threads; ++t) {
      seen_weight_[i] += right_[t][2 * i];
      target_sum_[2 * i] += sums_[t][2 * i];
      target_sum_[2 * i + 1] += sums_[t][2 * i + 1];
    }
  }
  if (!keep) return;
  // The coarse level is small and used most: it comes first.
  for (const ChromaLevel l : {ChromaLevel::kCoarse, ChromaLevel::kFine}) {
    View::Cells& cells = view->At(l);
    int64_t bytes = 0;
    for (const TileWeights& w : cells.weights) bytes += w.Bytes();
    cells.kept = kept_bytes_ + bytes <= budget_bytes_;
    if (cells.kept) {
      kept_bytes_ += bytes;
      for (TileWeights& w : cells.weights) w.ShrinkToFit();
    } else {
      cells.weights = {};
    }
    cells.d.assign(cells.target.size(), 0.0f);
  }
  views_.push_back(std::move(view));
}

// visit(tile, thread, weights) for every tile; a thread's tiles are always the same.
template <class Visitor>
void ChromaSystem::ForTiles(View& view, ChromaLevel level, const Visitor& visit) {
  const View::Cells& cells = view.At(level);
  if (!cells.kept) BinView(view.camera);
  const int64_t threads = pool_.thread_count();
  pool_.ForRanges(threads, [&](int64_t thread, int64_t, int) {
    TileWeights fine, coarse;
    for (int tile = static_cast<int>(thread); tile < view.tiles;
         tile += static_cast<int>(threads)) {
      if (cells.kept) {
        visit(tile, static_cast<int>(thread), cells.weights[tile]);
        continue;
      }
      BuildTileWeights(splats_, lists_, tile, view.camera.width, view.camera.height, fine);
      if (level == ChromaLevel::kCoarse) {
        const float* mask = view.At(ChromaLevel::kFine).mask.data();
        CoarsenTileWeights(fine, mask + static_cast<size_t>(tile) * kTilePixels, coarse);
      }
      visit(tile, static_cast<int>(thread), level == ChromaLevel::kCoarse ? coarse : fine);
    }
  });
}

void ChromaSystem::Basis(const RasterCamera& camera, int64_t i, float* basis) const {
  float d[3], square = 0.0f;
  for (int k = 0; k < 3; ++k) {
    d[k] = parameters_.Row(kPositionRow + k)[i] - camera.center[k];
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

// y += Y^T (sums over the threads), and the sums are zero again.
void ChromaSystem::AddSums(const RasterCamera& camera,
                           std::vector<AlignedFloats>& sums,
                           ChromaVector& y) {
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

void ChromaSystem::Reweight(ChromaLevel level,
                            const ChromaVector& x,
                            const RobustWeights& robust,
                            const CancellationToken& cancel,
                            Residuals& out) {
  const int blocks = BlocksOf(level), cells = blocks * kBlockCells;
  out.gradient.assign(x.size(), 0.0);
  out.right.assign(x.size(), 0.0);
  out.blocks.assign(static_cast<size_t>(count()) * 2 * coefficients_ * coefficients_, 0.0);
  ResetSums(sums_);
  ResetSums(squares_);
  ResetSums(right_);
  std::vector<double> l1(pool_.thread_count(), 0.0), total(pool_.thread_count(), 0.0);
  const float inverse_scale = static_cast<float>(1.0 / robust.scale);
  const float floor = static_cast<float>(robust.floor);
  for (const auto& view : views_) {
    cancel.ThrowIfCancelled();
    SetValues(view->camera, x);
    View::Cells& c = view->At(level);
    ForTiles(*view, level, [&](int tile, int thread, const TileWeights& weights) {
      alignas(64) float picture[2 * kTilePixels], right[2 * kTilePixels];
      TileForward(weights, blocks, value_.data(), picture);
      const float* mask = c.mask.data() + static_cast<size_t>(tile) * cells;
      const float* target = c.target.data() + static_cast<size_t>(tile) * 2 * cells;
      float* d = c.d.data() + static_cast<size_t>(tile) * 2 * cells;
      float sum = 0.0f, area = 0.0f;
      for (int i = 0; i < 2 * cells; ++i) {
        const float m = mask[i / (2 * kBlockCells) * kBlockCells + i % kBlockCells];
        const float r = target[i] - picture[i];
        sum += m * std::abs(r);
        area += m;
        d[i] = robust.on ? m / std::max(std::abs(r) * inverse_scale, floor) : m;
        picture[i] = d[i] * r;
        right[i] = d[i] * target[i];
      }
      l1[thread] += sum;
      total[thread] += area;
      TileAdjoint(weights, picture, sums_[thread].data());
      TileAdjoint(weights, right, right_[thread].data());
      TileSquares(weights, d, squares_[thread].data());
    });
    AddSums(view->camera, sums_, out.gradient);
    AddSums(view->camera, right_, out.right);
    AddBlocks(view->camera, out.blocks);
  }
  double sum = 0.0, area = 0.0;
  for (size_t t = 0; t < l1.size(); ++t) {
    sum += l1[t];
    area += total[t];
  }
  out.mean_l1 = area > 0.0 ? sum / area : 0.0;
}

void ChromaSystem::Sweep(ChromaVector& x,
                         const RobustWeights& robust,
                         double relaxation,
                         double rest_weight,
                         const std::vector<char>& seen,
                         const CancellationToken& cancel) {
  ResetSums(sums_);
  ResetSums(right_);
  const float inverse_scale = static_cast<float>(1.0 / robust.scale);
  const float floor = static_cast<float>(robust.floor);
  // The views one after another would drag the colours along the camera's path: a stride that is
  // coprime to their number visits all of them in mixed order.
  const size_t n = views_.size();
  size_t stride = std::max<size_t>(1, static_cast<size_t>(0.618 * static_cast<double>(n)));
  while (std::gcd(stride, n) != 1) ++stride;
  for (size_t k = 0; k < n; ++k) {
    cancel.ThrowIfCancelled();
    View& view = *views_[k * stride % n];
    SetValues(view.camera, x);
    View::Cells& c = view.At(ChromaLevel::kFine);
    ForTiles(view, ChromaLevel::kFine, [&](int tile, int thread, const TileWeights& weights) {
      alignas(64) float picture[2 * kTilePixels], d[2 * kTilePixels];
      TileForward(weights, kFineBlocks, value_.data(), picture);
      const float* mask = c.mask.data() + static_cast<size_t>(tile) * kTilePixels;
      const float* target = c.target.data() + static_cast<size_t>(tile) * 2 * kTilePixels;
      for (int i = 0; i < 2 * kTilePixels; ++i) {
        const float m = mask[i / (2 * kBlockCells) * kBlockCells + i % kBlockCells];
        const float r = target[i] - picture[i];
        d[i] = robust.on ? m / std::max(std::abs(r) * inverse_scale, floor) : m;
        picture[i] = d[i] * r;
      }
      TileAdjoint(weights, picture, sums_[thread].data());
      TileAdjoint(weights, d, right_[thread].data());
    });
    Step(view.camera, relaxation, rest_weight, seen, x);
  }
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

void ChromaSystem::Multiply(ChromaLevel level,
                            const ChromaVector& x,
                            const CancellationToken& cancel,
                            ChromaVector& y) {
  const int blocks = BlocksOf(level), cells = blocks * kBlockCells;
  y.assign(x.size(), 0.0);
  ResetSums(sums_);
  bool first = true;
  for (const auto& view : views_) {
    cancel.ThrowIfCancelled();
    // Values of degree 0 are the same for all views.
    if (first || coefficients_ > 1) SetValues(view->camera, x);
    first = false;
    View::Cells& c = view->At(level);
    ForTiles(*view, level, [&](int tile, int thread, const TileWeights& weights) {
      alignas(64) float picture[2 * kTilePixels];
      TileForward(weights, blocks, value_.data(), picture);
      const float* d = c.d.data() + static_cast<size_t>(tile) * 2 * cells;
      for (int i = 0; i < 2 * cells; ++i) picture[i] *= d[i];
      TileAdjoint(weights, picture, sums_[thread].data());
    });
    AddSums(view->camera, sums_, y);
  }
}

}  // namespace color3d
