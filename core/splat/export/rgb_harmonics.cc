#include "core/splat/export/rgb_harmonics.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "core/color/lab.h"
#include "core/splat/model/model_parameters.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {
namespace {

// Directions spread evenly over the sphere (spherical Fibonacci lattice).
std::vector<Eigen::Vector3d> FibonacciDirections(int count) {
  std::vector<Eigen::Vector3d> directions;
  const double golden_angle = M_PI * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count;
    const double radius = std::sqrt(1.0 - z * z);
    directions.emplace_back(
        radius * std::cos(golden_angle * i), radius * std::sin(golden_angle * i), z);
  }
  return directions;
}

Eigen::MatrixXd BasisMatrix(const std::vector<Eigen::Vector3d>& directions, int coefficients) {
  Eigen::MatrixXd basis(directions.size(), coefficients);
  double values[kMaxShCoefficients];
  for (size_t i = 0; i < directions.size(); ++i) {
    EvaluateSh(coefficients, directions[i].x(), directions[i].y(), directions[i].z(), values);
    for (int k = 0; k < coefficients; ++k) basis(static_cast<Eigen::Index>(i), k) = values[k];
  }
  return basis;
}

double ShValue(const Eigen::MatrixXd& basis, Eigen::Index direction, const float* sh, int count) {
  double sum = 0.0;
  for (int k = 0; k < count; ++k) sum += basis(direction, k) * sh[k];
  return sum;
}

}  // namespace

// Degree 0 needs one direction; otherwise four times as many as unknowns.
RgbHarmonicsFitter::RgbHarmonicsFitter(int degree)
    : coefficients_(ShCoefficients(degree)),
      directions_(FibonacciDirections(degree == 0 ? 1 : 4 * coefficients_)),
      basis_(BasisMatrix(directions_, kMaxShCoefficients)) {
  const Eigen::MatrixXd used = basis_.leftCols(coefficients_);
  solve_ = used.completeOrthogonalDecomposition().pseudoInverse();
}

Eigen::MatrixX3d RgbHarmonicsFitter::Colors(const GaussianModel& model, size_t index) const {
  const int luminance = ShCoefficients(model.sh_degree);
  const int chroma = model.channels == 3 ? ShCoefficients(model.chroma_sh_degree) : 0;
  Eigen::MatrixX3d rgb(basis_.rows(), 3);
  if (model.color_space == ColorSpace::kSrgb) {
    for (Eigen::Index d = 0; d < basis_.rows(); ++d) {
      rgb.row(d) << ShValue(basis_, d, model.sh_l.data() + index * luminance, luminance),
          ShValue(basis_, d, model.sh_a.data() + index * chroma, chroma),
          ShValue(basis_, d, model.sh_b.data() + index * chroma, chroma);
    }
    return (rgb.array() + 0.5).matrix();
  }
  for (Eigen::Index d = 0; d < basis_.rows(); ++d) {
    LabColor lab;
    const double l = 0.5 + ShValue(basis_, d, model.sh_l.data() + index * luminance, luminance);
    lab.l = 100.0 * std::clamp(l, 0.0, 1.0);
    if (chroma > 0) {  // a' - neutral is in units of 255
      lab.a = 255.0 * ShValue(basis_, d, model.sh_a.data() + index * chroma, chroma);
      lab.b = 255.0 * ShValue(basis_, d, model.sh_b.data() + index * chroma, chroma);
    }
    const RgbColor color = SrgbFromLab(lab);
    rgb.row(d) << color.r, color.g, color.b;
  }
  return rgb;
}

Eigen::MatrixX3d RgbHarmonicsFitter::Fit(const Eigen::MatrixX3d& colors) const {
  return solve_ * (colors.array() - 0.5).matrix();
}

RgbHarmonics FitRgbHarmonics(const GaussianModel& model, ThreadPool& pool) {
  CheckModel(model);
  RgbHarmonics rgb;
  rgb.degree = std::max(model.sh_degree, model.channels == 3 ? model.chroma_sh_degree : 0);
  const RgbHarmonicsFitter fitter(rgb.degree);
  const int coefficients = ShCoefficients(rgb.degree);
  rgb.sh.resize(model.size() * coefficients * 3);
  pool.ForRanges(static_cast<int64_t>(model.size()), [&](int64_t begin, int64_t end, int) {
    for (int64_t i = begin; i < end; ++i) {
      const Eigen::MatrixX3d sh = fitter.Fit(fitter.Colors(model, static_cast<size_t>(i)));
      float* out = rgb.sh.data() + i * coefficients * 3;
      for (int k = 0; k < coefficients; ++k) {
        for (int c = 0; c < 3; ++c) *out++ = static_cast<float>(sh(k, c));
      }
    }
  });
  return rgb;
}

RgbHarmonics DegreeZero(const RgbHarmonics& rgb) {
  const size_t row = static_cast<size_t>(ShCoefficients(rgb.degree)) * 3;
  RgbHarmonics zero;
  for (size_t at = 0; at < rgb.sh.size(); at += row) {
    zero.sh.insert(zero.sh.end(), rgb.sh.begin() + at, rgb.sh.begin() + at + 3);
  }
  return zero;
}

}  // namespace color3d
