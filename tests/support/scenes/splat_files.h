// Splat files as of other programs, for tests.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/splat/export/viewer_gaussians.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {

// A ball of radius 1 with a bright spot, above a wide ground (y points down), with flat Gaussians
// on the surfaces. `color`: difference of red and blue; 0: grey.
inline ViewerGaussians BallOnGround(int count, float color = 0.0f, int sh_degree = 0) {
  Random random(5);
  ViewerGaussians g;
  g.sh_degree = sh_degree;
  const int rest = ShCoefficients(sh_degree) - 1;
  for (int i = 0; i < count; ++i) {
    const bool ball = i % 2 == 0;
    double d[3] = {random.NextNormal(), random.NextNormal(), random.NextNormal()};
    const double norm = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) + 1e-9;
    for (double& x : d) x /= norm;
    const double ground[3] = {
        3.0 * std::tanh(random.NextNormal()), 1.0, 3.0 * std::tanh(random.NextNormal())};
    const double normal[3] = {ball ? d[0] : 0.0, ball ? d[1] : -1.0, ball ? d[2] : 0.0};
    for (int k = 0; k < 3; ++k) {
      g.position.push_back(static_cast<float>(ball ? d[k] : ground[k]));
    }
    for (const double s : {0.09, 0.09, 0.004}) {
      g.log_scale.push_back(static_cast<float>(std::log(s)));
    }
    // Rotation that maps z to the normal.
    const double w = 1.0 + normal[2];
    const double q[4] = {w, -normal[1], normal[0], 0.0};
    const double size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
    for (int k = 0; k < 4; ++k) {
      g.rotation.push_back(static_cast<float>(size > 1e-6 ? q[k] / size : k == 1 ? 1.0 : 0.0));
    }
    g.opacity_logit.push_back(4.0f);
    const float shade = ball ? (d[0] > 0.5 ? 1.2f : -0.6f) : 0.3f * std::sin(9.0f * i);
    for (int c = 0; c < 3; ++c) g.sh.push_back(shade + color * static_cast<float>(1 - c));
    for (int k = 0; k < 3 * rest; ++k)
      g.sh.push_back(0.1f * static_cast<float>(random.NextNormal()));
  }
  return g;
}

// Writes PLY as 3D Gaussian splatting does.
inline std::string SplatPly(const ViewerGaussians& g) {
  const int coefficients = ShCoefficients(g.sh_degree);
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(g.size()) + "\n";
  std::vector<std::string> names = {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"};
  for (int k = 0; k < 3 * (coefficients - 1); ++k) names.push_back("f_rest_" + std::to_string(k));
  names.insert(names.end(),
               {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"});
  for (const std::string& name : names) bytes += "property float " + name + "\n";
  bytes += "end_header\n";
  const auto put = [&](float v) { bytes.append(reinterpret_cast<const char*>(&v), sizeof(v)); };
  for (size_t i = 0; i < g.size(); ++i) {
    for (int k = 0; k < 3; ++k) put(g.position[3 * i + k]);
    const float* sh = g.sh.data() + 3 * coefficients * i;
    for (int c = 0; c < 3; ++c) put(sh[c]);
    for (int c = 0; c < 3; ++c) {
      for (int k = 1; k < coefficients; ++k) put(sh[3 * k + c]);
    }
    put(g.opacity_logit[i]);
    for (int k = 0; k < 3; ++k) put(g.log_scale[3 * i + k]);
    for (int k = 0; k < 4; ++k) put(g.rotation[4 * i + k]);
  }
  return bytes;
}

}  // namespace color3d
