#include "core/grid/grid_kernels.h"

#include <algorithm>

#include "core/simd/instruction_set.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/grid/grid_kernels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::CappedTag<float, 16>;
using Vec = hn::Vec<Tag>;

// Edge weights and neighbours of the pixels from i on, one register of them.
struct Stencil {
  Vec weight[8];
  int64_t offset[8];
};

HWY_INLINE Stencil LoadStencil(const GridSystem& s, int64_t i) {
  const Tag d;
  const int64_t w = s.width;
  return {{hn::LoadU(d, s.down_right.data() + i - w - 1),
           hn::LoadU(d, s.down.data() + i - w),
           hn::LoadU(d, s.down_left.data() + i - w + 1),
           hn::LoadU(d, s.right.data() + i - 1),
           hn::LoadU(d, s.right.data() + i),
           hn::LoadU(d, s.down_left.data() + i),
           hn::LoadU(d, s.down.data() + i),
           hn::LoadU(d, s.down_right.data() + i)},
          {-w - 1, -w, -w + 1, -1, 1, w - 1, w, w + 1}};
}

// -(A u). Differences are taken before they are weighted, which avoids cancellation for smooth u.
HWY_INLINE Vec MinusApplied(const Stencil& stencil, Vec data, const float* u) {
  const Tag d;
  const Vec center = hn::LoadU(d, u);
  Vec sum = hn::Zero(d);
  for (int k = 0; k < 8; ++k) {
    const Vec difference = hn::Sub(hn::LoadU(d, u + stencil.offset[k]), center);
    sum = hn::MulAdd(stencil.weight[k], difference, sum);
  }
  return hn::NegMulAdd(data, center, sum);
}

// A register of both components.
struct VecPair {
  Vec a, b;
};

HWY_INLINE VecPair MinusApplied(const GridSystem& s, const GridVector& u, int64_t i) {
  const Stencil stencil = LoadStencil(s, i);
  const Vec data = hn::LoadU(Tag(), s.data.data() + i);
  return {MinusApplied(stencil, data, u.a.data() + i), MinusApplied(stencil, data, u.b.data() + i)};
}

HWY_INLINE VecPair ResidualAt(const GridSystem& s,
                              const GridVector& u,
                              const GridVector& f,
                              int64_t i) {
  const Tag d;
  const VecPair applied = MinusApplied(s, u, i);
  return {hn::Add(hn::LoadU(d, f.a.data() + i), applied.a),
          hn::Add(hn::LoadU(d, f.b.data() + i), applied.b)};
}

void Residual(const GridSystem& s,
              const GridVector& u,
              const GridVector& f,
              int64_t begin,
              int64_t end,
              GridVector& out) {
  const Tag d;
  for (int64_t i = begin; i < end; i += static_cast<int64_t>(hn::Lanes(d))) {
    const VecPair residual = ResidualAt(s, u, f, i);
    hn::StoreU(residual.a, d, out.a.data() + i);
    hn::StoreU(residual.b, d, out.b.data() + i);
  }
}

// Products are summed in float32 within blocks of this many, in float64 beyond.
constexpr int64_t kDotBlock = 1024;

double DotPlane(const float* x, const float* y, int64_t begin, int64_t end) {
  const Tag d;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  double total = 0.0;
  for (int64_t block = begin; block < end; block += kDotBlock) {
    Vec even = hn::Zero(d), odd = hn::Zero(d);
    const int64_t block_end = std::min(end, block + kDotBlock);
    for (int64_t i = block; i < block_end; i += 2 * lanes) {
      even = hn::MulAdd(hn::LoadU(d, x + i), hn::LoadU(d, y + i), even);
      if (i + lanes >= block_end) continue;
      odd = hn::MulAdd(hn::LoadU(d, x + i + lanes), hn::LoadU(d, y + i + lanes), odd);
    }
    total += static_cast<double>(hn::GetLane(hn::SumOfLanes(d, hn::Add(even, odd))));
  }
  return total;
}

GridPair Dot(const GridVector& x, const GridVector& y, int64_t begin, int64_t end) {
  return {DotPlane(x.a.data(), y.a.data(), begin, end),
          DotPlane(x.b.data(), y.b.data(), begin, end)};
}

void CombinePlane(float p, float* x, float q, const float* y, int64_t begin, int64_t end) {
  const Tag d;
  const Vec ps = hn::Set(d, p), qs = hn::Set(d, q);
  for (int64_t i = begin; i < end; i += static_cast<int64_t>(hn::Lanes(d))) {
    hn::StoreU(hn::MulAdd(ps, hn::LoadU(d, x + i), hn::Mul(qs, hn::LoadU(d, y + i))), d, x + i);
  }
}

void Combine(const GridPair& p,
             GridVector& x,
             const GridPair& q,
             const GridVector& y,
             int64_t begin,
             int64_t end) {
  const auto f = [](double value) { return static_cast<float>(value); };
  CombinePlane(f(p[0]), x.a.data(), f(q[0]), y.a.data(), begin, end);
  CombinePlane(f(p[1]), x.b.data(), f(q[1]), y.b.data(), begin, end);
}

void Scale(
    const GridPlane& scale, const GridVector& f, int64_t begin, int64_t end, GridVector& out) {
  const Tag d;
  for (int64_t i = begin; i < end; i += static_cast<int64_t>(hn::Lanes(d))) {
    const Vec step = hn::LoadU(d, scale.data() + i);
    hn::StoreU(hn::Mul(step, hn::LoadU(d, f.a.data() + i)), d, out.a.data() + i);
    hn::StoreU(hn::Mul(step, hn::LoadU(d, f.b.data() + i)), d, out.b.data() + i);
  }
}

GridPair Apply(
    const GridSystem& s, const GridVector& u, int64_t begin, int64_t end, GridVector& out) {
  const Tag d;
  for (int64_t i = begin; i < end; i += static_cast<int64_t>(hn::Lanes(d))) {
    const VecPair applied = MinusApplied(s, u, i);
    hn::StoreU(hn::Neg(applied.a), d, out.a.data() + i);
    hn::StoreU(hn::Neg(applied.b), d, out.b.data() + i);
  }
  return Dot(u, out, begin, end);
}

void Jacobi(const GridSystem& s,
            const GridPlane& scale,
            const GridVector& u,
            const GridVector& f,
            int64_t begin,
            int64_t end,
            GridVector& out) {
  const Tag d;
  for (int64_t i = begin; i < end; i += static_cast<int64_t>(hn::Lanes(d))) {
    const Vec step = hn::LoadU(d, scale.data() + i);
    const VecPair residual = ResidualAt(s, u, f, i);
    hn::StoreU(hn::MulAdd(step, residual.a, hn::LoadU(d, u.a.data() + i)), d, out.a.data() + i);
    hn::StoreU(hn::MulAdd(step, residual.b, hn::LoadU(d, u.b.data() + i)), d, out.b.data() + i);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace color3d {
namespace {
HWY_EXPORT(Residual);
HWY_EXPORT(Apply);
HWY_EXPORT(Jacobi);
HWY_EXPORT(Dot);
HWY_EXPORT(Combine);
HWY_EXPORT(Scale);
}  // namespace

void GridResidual(const GridSystem& system,
                  const GridVector& u,
                  const GridVector& f,
                  int64_t begin,
                  int64_t end,
                  GridVector& out) {
  COLOR3D_KERNEL(Residual)(system, u, f, begin, end, out);
}

GridPair GridApply(
    const GridSystem& system, const GridVector& u, int64_t begin, int64_t end, GridVector& out) {
  return COLOR3D_KERNEL(Apply)(system, u, begin, end, out);
}

void GridJacobi(const GridSystem& system,
                const GridPlane& scale,
                const GridVector& u,
                const GridVector& f,
                int64_t begin,
                int64_t end,
                GridVector& out) {
  COLOR3D_KERNEL(Jacobi)(system, scale, u, f, begin, end, out);
}

void GridScale(
    const GridPlane& scale, const GridVector& f, int64_t begin, int64_t end, GridVector& out) {
  COLOR3D_KERNEL(Scale)(scale, f, begin, end, out);
}

GridPair GridDot(const GridVector& x, const GridVector& y, int64_t begin, int64_t end) {
  return COLOR3D_KERNEL(Dot)(x, y, begin, end);
}

void GridCombine(const GridPair& p,
                 GridVector& x,
                 const GridPair& q,
                 const GridVector& y,
                 int64_t begin,
                 int64_t end) {
  COLOR3D_KERNEL(Combine)(p, x, q, y, begin, end);
}

}  // namespace color3d
#endif  // HWY_ONCE
