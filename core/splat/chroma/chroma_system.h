// The linear system of chroma on fixed geometry. A picture's chroma, measured from neutral, is W c:
// blending weights times spherical harmonics (the background is neutral and drops out). Weighted
// least squares solves W^T D W c = W^T D t with the target t and pixel weights D. The products are
// matrix-free over the views; blending weights (chroma_weights.h), targets and D are cached within
// a byte budget. For other views they are recomputed from the splats, the targets, and the
// coefficients of the last reweighting, with bitwise equal results. Internal to the splat module.
// Not thread-safe; uses the pool's threads. Deterministic for a thread count.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/splat/chroma/chroma_tile.h"
#include "core/splat/model/parameter_block.h"
#include "core/splat/motion/geometry_in_time.h"
#include "core/splat/raster/binning.h"
#include "core/splat/raster/projection.h"

namespace color3d {

// Coefficient k of channel c (0: a', 1: b') of Gaussian i at [(i * coefficients + k) * 2 + c].
using ChromaVector = std::vector<double>;

class ChromaSystem {
 public:
  // `parameters` holds the geometry and has the rows of `color` (two channels of equal
  // numbers of coefficients); `in_time` moves them to a view's time; `targets` returns the targets
  // of views beyond the budget. All must outlive this object.
  ChromaSystem(const ParameterBlock& parameters,
               const ColorSpec& color,
               GeometryInTime& in_time,
               ChromaTargets& targets,
               int64_t budget_bytes,
               ThreadPool& pool);
  ~ChromaSystem();

  // `planes`: the view's planes from `targets`, with confidence. With `solve` false only the sums
  // below are computed. Returns true if the view is within the budget.
  bool AddView(const PosedCamera& view, const ChromaPlanes& planes, bool solve);

  int64_t count() const { return parameters_.count(); }
  int coefficients() const { return coefficients_; }
  int64_t kept_bytes() const;  // of all views, at most the budget
  // Over all views and pixels: sum of weight w, [i], and of weight w t, [2 i + c].
  const std::vector<double>& seen_weight() const { return seen_weight_; }
  const std::vector<double>& target_sum() const { return target_sum_; }
  // The same of weight w confidence, [i].
  const std::vector<double>& confidence_sum() const { return confidence_sum_; }

  // One ordered-subsets sweep: D and a step from each view alone (Andersen & Kak 1984; Hudson &
  // Larkin 1994). x += relaxation * B^-1 W_v^T D (t - W_v x), with B the larger of the row sums of
  // W_v^T D W_v and their mean over the views. Fast at first, never exact. Gaussians that are not
  // `seen` are unchanged; `rest_weight` is the share of coefficients above degree 0. Returns the
  // weighted mean of |t - W x|, each view before its step.
  double Sweep(const RobustWeights& robust,
               double relaxation,
               double rest_weight,
               const std::vector<char>& seen,
               const CancellationToken& cancel,
               ChromaVector& x);

  struct Residuals {
    double mean_l1 = 0.0;   // weighted mean of |t - W x| over pixels and channels
    ChromaVector gradient;  // W^T D (t - W x)
    ChromaVector right;     // W^T D t
    // Diagonal blocks of W^T D W, [((i * 2 + c) * K + k) * K + l].
    std::vector<double> blocks;
  };
  // Sets D from the residuals at x.
  void Reweight(const ChromaVector& x,
                const RobustWeights& robust,
                const CancellationToken& cancel,
                Residuals& out);
  // y = W^T D W x.
  void Multiply(const ChromaVector& x, const CancellationToken& cancel, ChromaVector& y);

 private:
  struct View;
  struct Tile;
  using Sums = std::vector<AlignedFloats>;  // per thread, two numbers per Gaussian
  struct PixelSums {
    double l1 = 0.0;
    double weight = 0.0;
    double Mean() const { return weight > 0.0 ? l1 / weight : 0.0; }
  };

  bool Keep(std::unique_ptr<View> view);
  template <class Order, class Visitor>
  void ForViews(const CancellationToken& cancel, const Order& order, const Visitor& visit);
  template <class Visitor>
  void ForTiles(View& view, const ChromaPlanes* planes, const Visitor& visit);
  void BinView(const RasterCamera& camera);
  void Enter(double time_s) { at_ = &in_time_.At(parameters_, time_s); }
  void Basis(const RasterCamera& camera, int64_t i, float* basis) const;
  void SetValues(const RasterCamera& camera, const ChromaVector& x, AlignedFloats& value);
  PixelSums SumOfThreads();
  void AddSums(const RasterCamera& camera, Sums& sums, ChromaVector& y);
  void AddBlocks(const RasterCamera& camera, std::vector<double>& blocks);
  void Step(const RasterCamera& camera,
            double relaxation,
            double rest_weight,
            const std::vector<char>& seen,
            ChromaVector& x);
  void ResetSums(Sums& sums) const;

  const ParameterBlock& parameters_;
  ColorSpec color_;
  GeometryInTime& in_time_;
  ChromaTargets& targets_;
  const ParameterBlock* at_;  // parameters_ at the time of the current view
  int coefficients_;
  int64_t budget_bytes_;
  bool is_full_ = false;  // a view exceeded the budget
  ThreadPool& pool_;
  std::vector<std::unique_ptr<View>> views_;
  std::vector<double> seen_weight_, target_sum_, confidence_sum_;
  RobustWeights robust_;     // of the last reweighting
  ChromaVector weighed_at_;  // coefficients at that time
  // Work space.
  SplatBuffer splats_;
  TileBinner binner_;
  TileLists lists_;
  AlignedFloats value_, weighed_value_;  // two per Gaussian, of the current view
  Sums sums_, squares_, right_;
  std::vector<PixelSums> pixel_sums_;  // per thread
};

}  // namespace color3d
