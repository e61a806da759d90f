#include "core/splat/import/gray_model.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/splat/export/rgb_harmonics.h"
#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/raster/raster_constants.h"

namespace color3d {
namespace {

constexpr float kMaxLogit = 15.0f;
// dL'/dx of grey x at white: values above white continue linearly, as in the file.
constexpr double kSlopeAtWhite = 0.88;

bool AnyNan(const float* values, size_t count) {
  return std::any_of(values, values + count, [](float v) { return std::isnan(v); });
}
bool AllFinite(const float* values, size_t count) {
  return std::all_of(values, values + count, [](float v) { return std::isfinite(v); });
}

// Gaussians that can be drawn at all.
std::vector<size_t> Usable(const ViewerGaussians& splat) {
  const size_t row = 3 * static_cast<size_t>(ShCoefficients(splat.sh_degree));
  std::vector<size_t> usable;
  for (size_t i = 0; i < splat.size(); ++i) {
    if (AllFinite(splat.position.data() + 3 * i, 3) &&
        AllFinite(splat.rotation.data() + 4 * i, 4) && AllFinite(splat.sh.data() + row * i, row) &&
        !AnyNan(splat.log_scale.data() + 3 * i, 3) && !std::isnan(splat.opacity_logit[i])) {
      usable.push_back(i);
    }
  }
  return usable;
}

void UnitRotation(const float* q, float* out) {
  const double norm = std::sqrt(double{q[0]} * q[0] + double{q[1]} * q[1] + double{q[2]} * q[2] +
                                double{q[3]} * q[3]);
  for (int k = 0; k < 4; ++k) {
    out[k] = norm > 1e-12 ? static_cast<float>(q[k] / norm) : (k == 0 ? 1.0f : 0.0f);
  }
}

// sRGB's transfer function from a table: a splat of a million Gaussians evaluates it 200 million
// times. Agrees with the formula to 1e-6.
class LinearLight {
 public:
  LinearLight() : table_(kSteps + 2) {
    for (int i = 0; i < kSteps + 2; ++i) {
      const double x = static_cast<double>(i) / kSteps;
      table_[i] = x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
    }
  }
  double operator()(double x) const {
    const double at = std::clamp(x, 0.0, 1.0) * kSteps;
    const int i = static_cast<int>(at);
    return table_[i] + (at - i) * (table_[i + 1] - table_[i]);
  }

 private:
  static constexpr int kSteps = 8192;
  std::vector<double> table_;
};

// L' of a colour: 0..1, and slightly more for colours above white.
double Luminance(double r, double g, double b, const LinearLight& linear) {
  // The second row of lab.cc's matrix, for a white of 1.
  const double y = 0.2126729 * linear(r) + 0.7151522 * linear(g) + 0.0721750 * linear(b);
  const double l = y > 216.0 / 24389.0 ? 1.16 * std::cbrt(y) - 0.16 : y * 243.89 / 27.0;
  return l + kSlopeAtWhite * std::max(0.0, std::min({r, g, b}) - 1.0);
}

// Squared distance from grey of a Gaussian's mean colour over directions, Lab units.
double SquaredChroma(const float* sh) {
  const auto channel = [&](int c) { return std::clamp(0.5 + double{kShDc} * sh[c], 0.0, 1.0); };
  const LabColor lab = LabFromSrgb(RgbColor{channel(0), channel(1), channel(2)});
  return lab.a * lab.a + lab.b * lab.b;
}

struct ChromaSums {
  double squares = 0.0;
  double weight = 0.0;
};

}  // namespace

GraySplat GrayModelOf(const ViewerGaussians& splat, const std::string& name, ThreadPool& pool) {
  const std::vector<size_t> usable = Usable(splat);
  if (usable.empty()) {
    throw InvalidArgument(
        "{} holds no Gaussian that could be drawn ({} in all, each with a value that is not a "
        "number)",
        name,
        splat.size());
  }
  const size_t count = usable.size();
  GraySplat gray;
  gray.dropped = static_cast<int64_t>(splat.size() - count);
  GaussianModel& model = gray.model;
  model.sh_degree = splat.sh_degree;
  model.position.resize(3 * count);
  model.log_scale.resize(3 * count);
  model.rotation.resize(4 * count);
  model.opacity_logit.resize(count);
  const int coefficients = ShCoefficients(splat.sh_degree);
  model.sh_l.resize(count * coefficients);
  const RgbHarmonicsFitter fitter(splat.sh_degree);
  const Eigen::MatrixXd basis = fitter.Basis();
  const Eigen::MatrixXd& solve = fitter.Solver();
  std::vector<ChromaSums> sums(pool.thread_count());
  const LinearLight linear;
  pool.ForRanges(static_cast<int64_t>(count), [&](int64_t begin, int64_t end, int thread) {
    Eigen::VectorXd luminance(basis.rows());
    Eigen::MatrixX3d rgb(basis.rows(), 3);
    for (int64_t i = begin; i < end; ++i) {
      const size_t from = usable[i];
      std::copy_n(splat.position.data() + 3 * from, 3, model.position.data() + 3 * i);
      UnitRotation(splat.rotation.data() + 4 * from, model.rotation.data() + 4 * i);
      for (int k = 0; k < 3; ++k) {
        model.log_scale[3 * i + k] =
            std::clamp(splat.log_scale[3 * from + k], kMinLogScale, kMaxLogScale);
      }
      model.opacity_logit[i] = std::clamp(splat.opacity_logit[from], -kMaxLogit, kMaxLogit);
      const float* sh = splat.sh.data() + 3 * coefficients * from;
      rgb.setConstant(0.5);
      for (int k = 0; k < coefficients; ++k) {
        for (int c = 0; c < 3; ++c) rgb.col(c) += basis.col(k) * double{sh[3 * k + c]};
      }
      for (Eigen::Index d = 0; d < rgb.rows(); ++d) {
        luminance[d] = Luminance(rgb(d, 0), rgb(d, 1), rgb(d, 2), linear) - 0.5;
      }
      const Eigen::VectorXd fitted = solve * luminance;
      for (int k = 0; k < coefficients; ++k) {
        model.sh_l[i * coefficients + k] = static_cast<float>(fitted[k]);
      }
      const double opacity = 1.0 / (1.0 + std::exp(-double{model.opacity_logit[i]}));
      sums[thread].squares += opacity * SquaredChroma(sh);
      sums[thread].weight += opacity;
    }
  });
  ChromaSums all;
  for (const ChromaSums& part : sums) {
    all.squares += part.squares;
    all.weight += part.weight;
  }
  gray.chroma = all.weight > 0.0 ? std::sqrt(all.squares / all.weight) : 0.0;
  return gray;
}

}  // namespace color3d
