// All buffers of a Gaussian model. Internal to the splat module.
#pragma once

#include <cstddef>

#include "core/splat/model/gaussian_model.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {

// Calls visit(name, buffer, width, count) in the order of the native file.
template <class Model, class Visit>
void ForEachBuffer(Model& m, size_t count, size_t moving, bool with_confidence, Visit&& visit) {
  const int chroma = m.channels == 3 ? ShCoefficients(m.chroma_sh_degree) : 0;
  visit("position", m.position, 3, count);
  visit("log_scale", m.log_scale, 3, count);
  visit("rotation", m.rotation, 4, count);
  visit("opacity_logit", m.opacity_logit, 1, count);
  visit("sh_l", m.sh_l, ShCoefficients(m.sh_degree), count);
  visit("sh_a", m.sh_a, chroma, count);
  visit("sh_b", m.sh_b, chroma, count);
  if (with_confidence) visit("confidence", m.confidence, 1, count);
  visit("velocity", m.motion.velocity, 3, moving);
  visit("acceleration", m.motion.acceleration, 3, moving);
  visit("spin", m.motion.spin, 4, moving);
  visit("center", m.motion.center, 1, moving);
  visit("log_width", m.motion.log_width, 1, moving);
}

}  // namespace color3d
