// What a camera's automatic exposure did to each training photo: photo = gain * scene + offset,
// fitted beside the geometry, so that the geometry need not explain it. Internal to the splat
// module. Deterministic whatever the thread count.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/parallel.h"
#include "core/simd/plane_buffer.h"
#include "core/splat/training/checkpoint.h"

namespace color3d {

// Of one photo, with Adam's moments. The identity until it is fitted.
struct PhotoExposure {
  double log_gain = 0.0;
  double offset = 0.0;  // of values 0..1
  double first[2] = {0.0, 0.0};
  double second[2] = {0.0, 0.0};
  int64_t steps = 0;
};

// One for each training view, or none.
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

// Gains of mean ln 0, offsets of mean 0: what all photos have in common is the scene's.
void Recenter(Exposures& exposures);

}  // namespace color3d
