// Options of the elastic transform of training pictures.
#pragma once

namespace color3d {

struct ElasticOptions {
  enum class Kind {
    kSpline,  // ElasticField: bounded by alpha_px, nodes sigma_px apart
    kNoise,   // ElasticNoise: blurred by sigma_px, times alpha_px, after an affine map
  };
  Kind kind = Kind::kSpline;
  double alpha_px = 15.0;   // 0..10000
  double sigma_px = 50.0;   // 1..1000
  double affine_px = 50.0;  // kNoise: maximum displacement of the points of the affine map, 0..1000
  bool operator==(const ElasticOptions&) const = default;
};

}  // namespace color3d
