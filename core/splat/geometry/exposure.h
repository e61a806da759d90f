// Automatic exposure of the camera in each training photo: photo = gain * scene + offset, fitted
// with the geometry so that the geometry does not absorb it. Internal to the splat module.
// Deterministic for every thread count.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/parallel.h"
#include "core/simd/plane_buffer.h"
#include "core/splat/training/checkpoint.h"

namespace color3d {

// Exposure of one photo, with Adam's moments. The identity until fitted.
struct PhotoExposure {
  double log_gain = 0.0;
  double offset = 0.0;  // of values 0..1
  double first[2] = {0.0, 0.0};
  double second[2] = {0.0, 0.0};
  int64_t steps = 0;
};

// One for each training view, or empty.
using Exposures = std::vector<PhotoExposure>;

// gain * drawn + offset.
void Expose(const PhotoExposure& exposure,
            const PlaneBuffer& drawn,
            ThreadPool& pool,
            PlaneBuffer& exposed);

// One step of Adam by d_exposed = dL/d(exposed), with a prior of prior * (log_gain^2 + offset^2) in
// L; d_exposed becomes dL/d(drawn).
void FitExposure(const PlaneBuffer& drawn,
                 double rate,
                 double prior,
                 ThreadPool& pool,
                 PlaneBuffer& d_exposed,
                 PhotoExposure& exposure);

// Normalizes gains to mean ln 0 and offsets to mean 0: the common part belongs to the scene.
void Recenter(Exposures& exposures);

}  // namespace color3d
