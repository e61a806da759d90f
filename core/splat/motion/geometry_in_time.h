// A model's Gaussians at successive times, in a reused buffer. Internal to the splat module. Not
// thread-safe; uses the pool's threads.
#pragma once

#include "core/base/parallel.h"
#include "core/splat/motion/motion.h"

namespace color3d {

class GeometryInTime {
 public:
  // Uses `model`'s motion. `pool` must outlive this object.
  GeometryInTime(const GaussianModel& model, ThreadPool& pool)
      : times_{model.motion.begin_s, model.motion.end_s, {}, {}, {}, {}, {}},
        motion_(MotionFromModel(model)),
        pool_(pool) {}

  // Returns `all`, which has the model's Gaussians and any colours, at a time of the scene in
  // seconds: `all` itself for static models, else a buffer that is valid until the next call.
  const ParameterBlock& At(const ParameterBlock& all, double time_s) {
    if (motion_.count() == 0) return all;
    at_ = all;
    ApplyMotion({motion_, 0, times_.UnitTime(time_s), all.count() - motion_.count()}, pool_, at_);
    return at_;
  }

 private:
  GaussianMotion times_;  // begin and end alone
  ParameterBlock motion_;
  ThreadPool& pool_;
  ParameterBlock at_;
};

}  // namespace color3d
