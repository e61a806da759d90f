// A random model for tests of files and exports.
#pragma once

#include "core/base/random.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {

struct RandomModelOptions {
  size_t count = 0;
  int channels = 3;
  int sh_degree = 0;
  int chroma_sh_degree = 0;
  double chroma_size = 0.15;  // standard deviation of a' and b' coefficients
};

inline GaussianModel RandomModel(const RandomModelOptions& options) {
  Random random(3);
  GaussianModel m;
  m.channels = options.channels;
  m.sh_degree = options.sh_degree;
  m.chroma_sh_degree = options.chroma_sh_degree;
  const auto fill = [&](std::vector<float>& buffer, int width, double size) {
    for (size_t i = 0; i < options.count * width; ++i) {
      buffer.push_back(static_cast<float>(size * random.NextNormal()));
    }
  };
  fill(m.position, 3, 1.0);
  fill(m.log_scale, 3, 1.0);
  fill(m.rotation, 4, 1.0);
  fill(m.opacity_logit, 1, 1.0);
  fill(m.sh_l, ShCoefficients(m.sh_degree), 0.2);
  if (m.channels == 3) {
    fill(m.sh_a, ShCoefficients(m.chroma_sh_degree), options.chroma_size);
    fill(m.sh_b, ShCoefficients(m.chroma_sh_degree), options.chroma_size);
  }
  return m;
}

// Times 1 s to 3 s, positions from -2 to 2.
inline HexPlaneField RandomHexPlanes() {
  Random random(6);
  HexPlaneField field;
  HexPlaneShape& shape = field.shape;
  shape.begin_s = 1.0;
  shape.end_s = 3.0;
  shape.low = {-2.0f, -2.0f, -2.0f};
  shape.high = {2.0f, 2.0f, 2.0f};
  shape.width = 16;
  shape.levels = {{3, 4}, {5, 4}};
  const auto fill = [&](std::vector<float>& numbers, size_t count, double low, double high) {
    for (size_t i = 0; i < count; ++i) {
      numbers.push_back(static_cast<float>(random.NextUniform(low, high)));
    }
  };
  fill(field.planes, shape.PlaneFloats(), 0.5, 1.5);
  fill(field.network, shape.NetworkFloats(), -0.4, 0.4);
  return field;
}

}  // namespace color3d
