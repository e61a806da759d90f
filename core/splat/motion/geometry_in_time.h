// Geometry at a time: the one place that knows the kinds of deformation of a model (DYNAMIC.md
// "Motion", "HexPlane"). Internal to the splat module. Not thread-safe; uses the pool's threads.
#pragma once

#include <memory>

#include "core/base/parallel.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/model/parameter_block.h"

namespace color3d {

// How the Gaussians of a model depend on time.
class Deformation {
 public:
  virtual ~Deformation() = default;
  // Takes the Gaussians of `at`, whose last ones are those that move, to a time of the scene in
  // seconds.
  virtual void Apply(double time_s, ThreadPool& pool, ParameterBlock& at) const = 0;
};

// Null for static models. The result does not refer to `model`.
std::unique_ptr<Deformation> DeformationOf(const GaussianModel& model);

// A model's Gaussians at successive times, in a reused buffer.
class GeometryInTime {
 public:
  // Uses `model`'s deformation. `pool` must outlive this object.
  GeometryInTime(const GaussianModel& model, ThreadPool& pool)
      : deformation_(DeformationOf(model)), pool_(pool) {}

  // Returns `all`, which has the model's Gaussians and any colours, at a time of the scene in
  // seconds: `all` itself for static models, else a buffer that is valid until the next call.
  const ParameterBlock& At(const ParameterBlock& all, double time_s) {
    if (deformation_ == nullptr) return all;
    at_ = all;
    deformation_->Apply(time_s, pool_, at_);
    return at_;
  }

 private:
  const std::unique_ptr<const Deformation> deformation_;
  ThreadPool& pool_;
  ParameterBlock at_;
};

// Returns the model's parameters at a time of the scene.
ParameterBlock ParametersAt(const GaussianModel& model, double time_s, ThreadPool& pool);
// Returns the Gaussians that are seen at that time, as a model without deformation.
GaussianModel ModelAt(const GaussianModel& model, double time_s, ThreadPool& pool);

}  // namespace color3d
