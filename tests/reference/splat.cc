#include "tests/reference/splat.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <unsupported/Eigen/AutoDiff>

#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/raster/raster_constants.h"

namespace color3d {
namespace {

using std::exp;
using std::sqrt;

constexpr int kShapeRows = kColorRow;  // position, log scale, rotation, opacity
// A number with its derivatives by the shape rows. Automatic differentiation, since derivatives by
// hand could repeat an error of a kernel.
using ShapeJet = Eigen::AutoDiffScalar<Eigen::Matrix<double, kShapeRows, 1>>;

// A projected Gaussian. T is double, or a jet by the Gaussian's shape rows.
template <class T>
struct Splat {
  int index = 0;
  T depth, u, v;
  T xx, xy, yy;  // 2D covariance with dilation
  T conic_xx, conic_xy, conic_yy;
  T opacity;
  T color[3];
};

double Variable(double value, int, double) { return value; }
ShapeJet Variable(double value, int row, const ShapeJet&) {
  return ShapeJet(value, kShapeRows, row);
}

double ValueOf(double x) { return x; }
double ValueOf(const ShapeJet& x) { return x.value(); }

// 1 / (1 + exp(-x)) without overflow of the derivative.
double Sigmoid(double x) { return 1.0 / (1.0 + std::exp(-x)); }
ShapeJet Sigmoid(const ShapeJet& x) {
  const double s = Sigmoid(x.value());
  return ShapeJet(s, s * Sigmoid(-x.value()) * x.derivatives());
}

// Clamps to [low, high], with derivative 0 outside.
template <class T>
T Limited(const T& x, double low, double high) {
  return ValueOf(x) < low ? T(low) : ValueOf(x) > high ? T(high) : x;
}

template <class T>
void Rotation(const T* parameters, T r[3][3]) {
  T q[4], norm = 1e-24;
  for (int k = 0; k < 4; ++k)
    norm = norm + parameters[kRotationRow + k] * parameters[kRotationRow + k];
  norm = sqrt(norm);
  for (int k = 0; k < 4; ++k) q[k] = parameters[kRotationRow + k] / norm;
  const T w = q[0], x = q[1], y = q[2], z = q[3];
  const T values[3][3] = {
      {1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)},
      {2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)},
      {2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)}};
  std::copy(&values[0][0], &values[0][0] + 9, &r[0][0]);
}

// M = J W R S.
template <class T>
void ScreenAxes(const T* parameters, const RasterCamera& c, const T cam[3], T m[2][3]) {
  T r[3][3];
  Rotation(parameters, r);
  const double fx = c.fx, fy = c.fy, cx = c.cx, cy = c.cy;
  const double margin_x = kFrustumMargin * 0.5 * c.width / fx;
  const double margin_y = kFrustumMargin * 0.5 * c.height / fy;
  const T tx = Limited<T>(cam[0] / cam[2], -cx / fx - margin_x, (c.width - cx) / fx + margin_x);
  const T ty = Limited<T>(cam[1] / cam[2], -cy / fy - margin_y, (c.height - cy) / fy + margin_y);
  const T jacobian[2][3] = {{fx / cam[2], 0.0, -fx * tx / cam[2]},
                            {0.0, fy / cam[2], -fy * ty / cam[2]}};
  for (int row = 0; row < 2; ++row) {
    for (int k = 0; k < 3; ++k) {
      T sum(0.0);
      for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
          sum = sum + jacobian[row][a] * double{c.rotation[3 * a + b]} * r[b][k];
        }
      }
      m[row][k] = sum * exp(Limited<T>(parameters[kLogScaleRow + k], kMinLogScale, kMaxLogScale));
    }
  }
}

// The determinant is the sum of the squared 2x2 minors of M and of the dilation's terms (Cauchy and
// Binet). As xx yy - xy^2 even float64 would cancel for a needle of 1e8 px.
template <class T>
void Conic(const T m[2][3], Splat<T>& s) {
  const double dilation = kCovarianceDilation;
  T n0 = 0.0, n1 = 0.0, xy = 0.0, minors = 0.0;
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    const T minor = m[0][k] * m[1][next] - m[0][next] * m[1][k];
    n0 = n0 + m[0][k] * m[0][k];
    n1 = n1 + m[1][k] * m[1][k];
    xy = xy + m[0][k] * m[1][k];
    minors = minors + minor * minor;
  }
  const T det = minors + dilation * (n0 + n1) + dilation * dilation;
  s.xx = n0 + dilation;
  s.xy = xy;
  s.yy = n1 + dilation;
  s.conic_xx = s.yy / det;
  s.conic_xy = -xy / det;
  s.conic_yy = s.xx / det;
}

template <class T>
void Color(const ReferenceParameters& p,
           const T* parameters,
           const ColorSpec& color,
           const RasterCamera& c,
           Splat<T>& splat) {
  T d[3], norm = 1e-24;
  for (int k = 0; k < 3; ++k) {
    d[k] = parameters[kPositionRow + k] - double{c.center[k]};
    norm = norm + d[k] * d[k];
  }
  norm = sqrt(norm);
  T basis[kMaxShCoefficients];
  EvaluateSh<T>(kMaxShCoefficients, d[0] / norm, d[1] / norm, d[2] / norm, basis);
  for (int ch = 0; ch < color.channels; ++ch) {
    T value = double{color.channel[ch].base};
    for (int k = 0; k < color.channel[ch].coefficients; ++k) {
      value = value + basis[k] * p.At(color.channel[ch].row + k, splat.index);
    }
    splat.color[ch] = color.channel[ch].clamp_at_zero && ValueOf(value) < 0.0 ? T(0.0) : value;
  }
}

// Returns false if the Gaussian is behind the near plane.
template <class T>
bool Project(const ReferenceParameters& p,
             const ColorSpec& color,
             const RasterCamera& c,
             int i,
             Splat<T>& splat) {
  T parameters[kShapeRows];
  for (int row = 0; row < kShapeRows; ++row) parameters[row] = Variable(p.At(row, i), row, T());
  T cam[3];
  for (int a = 0; a < 3; ++a) {
    cam[a] = double{c.translation[a]};
    for (int b = 0; b < 3; ++b) {
      cam[a] = cam[a] + double{c.rotation[3 * a + b]} * parameters[kPositionRow + b];
    }
  }
  if (!(ValueOf(cam[2]) > kNearPlane)) return false;
  splat.index = i;
  splat.depth = cam[2];
  splat.u = double{c.fx} * cam[0] / cam[2] + double{c.cx};
  splat.v = double{c.fy} * cam[1] / cam[2] + double{c.cy};
  T m[2][3];
  ScreenAxes(parameters, c, cam, m);
  Conic(m, splat);
  splat.opacity = Sigmoid(parameters[kOpacityRow]);
  Color(p, parameters, color, c, splat);
  return true;
}

std::vector<Splat<double>> ProjectSorted(const ReferenceParameters& p,
                                         const ColorSpec& color,
                                         const RasterCamera& camera) {
  std::vector<Splat<double>> splats;
  for (int i = 0; i < p.count; ++i) {
    Splat<double> splat;
    if (Project(p, color, camera, i, splat)) splats.push_back(splat);
  }
  std::stable_sort(
      splats.begin(), splats.end(), [](const auto& a, const auto& b) { return a.depth < b.depth; });
  return splats;
}

// Contribution of a splat to a pixel.
struct Contribution {
  size_t splat = 0;
  double dx = 0.0, dy = 0.0;
  double alpha = 0.0;
  double transmittance = 1.0;  // before it
  bool capped = false;
};

// Blends front to back; returns the remaining transmittance.
double Blend(const std::vector<Splat<double>>& splats,
             int x,
             int y,
             double margin,
             std::vector<Contribution>& contributions,
             bool* near_threshold) {
  contributions.clear();
  *near_threshold = false;
  const auto check = [&](double value, double threshold) {
    *near_threshold = *near_threshold || std::abs(std::log(value / threshold)) < margin;
  };
  double t = 1.0;
  for (size_t i = 0; i < splats.size(); ++i) {
    if (t < kMinTransmittance) break;
    const Splat<double>& s = splats[i];
    const double dx = x + 0.5 - s.u, dy = y + 0.5 - s.v;
    const double power =
        -0.5 * (s.conic_xx * dx * dx + s.conic_yy * dy * dy) - s.conic_xy * dx * dy;
    if (power < -50.0) continue;
    const double raw = s.opacity * std::exp(power);
    check(raw, kMinAlpha);
    if (raw < kMinAlpha) continue;
    check(raw, kMaxAlpha);
    const double alpha = std::min<double>(kMaxAlpha, raw);
    contributions.push_back({i, dx, dy, alpha, t, raw > kMaxAlpha});
    t *= 1.0 - alpha;
    check(t, kMinTransmittance);
  }
  return t;
}

// dL/d(u, v, conic, opacity, colour) of one Gaussian.
struct ScreenGradient {
  double u = 0.0, v = 0.0, conic_xx = 0.0, conic_xy = 0.0, conic_yy = 0.0, opacity = 0.0;
  double color[3] = {};
};

// Adjoint of one pixel's blending sum, back to front with S = the colour behind:
// dC/d(alpha) = c T - S / (1 - alpha).
void BlendBackward(const std::vector<Splat<double>>& splats,
                   const std::vector<Contribution>& contributions,
                   int channels,
                   const std::vector<double>& background,
                   double last_transmittance,
                   const std::array<double, 3>& d_color,
                   std::vector<ScreenGradient>& gradient) {
  double behind = 0.0;
  for (int c = 0; c < channels; ++c) behind += d_color[c] * background[c] * last_transmittance;
  for (size_t k = contributions.size(); k-- > 0;) {
    const Contribution& at = contributions[k];
    const Splat<double>& s = splats[at.splat];
    ScreenGradient& g = gradient[s.index];
    double own = 0.0;
    for (int c = 0; c < channels; ++c) {
      own += d_color[c] * s.color[c];
      g.color[c] += d_color[c] * at.alpha * at.transmittance;
    }
    const double d_alpha = own * at.transmittance - behind / (1.0 - at.alpha);
    behind += own * at.alpha * at.transmittance;
    if (at.capped) continue;
    const double d_power = d_alpha * at.alpha;
    g.opacity += d_power / s.opacity;
    g.conic_xx -= 0.5 * d_power * at.dx * at.dx;
    g.conic_xy -= d_power * at.dx * at.dy;
    g.conic_yy -= 0.5 * d_power * at.dy * at.dy;
    g.u += d_power * (s.conic_xx * at.dx + s.conic_xy * at.dy);
    g.v += d_power * (s.conic_yy * at.dy + s.conic_xy * at.dx);
  }
}

// Propagates gradients from the projection to the parameters of Gaussian i.
void ProjectBackward(const ReferenceParameters& p,
                     const ColorSpec& color,
                     const RasterCamera& camera,
                     int i,
                     const ScreenGradient& g,
                     ReferenceParameters& gradient) {
  Splat<ShapeJet> s;
  if (!Project(p, color, camera, i, s)) return;
  for (int row = 0; row < kShapeRows; ++row) {
    double sum =
        g.u * s.u.derivatives()[row] + g.v * s.v.derivatives()[row] +
        g.conic_xx * s.conic_xx.derivatives()[row] + g.conic_xy * s.conic_xy.derivatives()[row] +
        g.conic_yy * s.conic_yy.derivatives()[row] + g.opacity * s.opacity.derivatives()[row];
    for (int c = 0; c < color.channels; ++c) sum += g.color[c] * s.color[c].derivatives()[row];
    gradient.At(row, i) = sum;
  }
  double d[3], norm = 1e-24, basis[kMaxShCoefficients];
  for (int k = 0; k < 3; ++k) {
    d[k] = p.At(kPositionRow + k, i) - camera.center[k];
    norm += d[k] * d[k];
  }
  norm = std::sqrt(norm);
  EvaluateSh<double>(kMaxShCoefficients, d[0] / norm, d[1] / norm, d[2] / norm, basis);
  for (int c = 0; c < color.channels; ++c) {
    if (color.channel[c].clamp_at_zero && !(s.color[c].value() > 0.0)) continue;
    for (int k = 0; k < color.channel[c].coefficients; ++k) {
      gradient.At(color.channel[c].row + k, i) += g.color[c] * basis[k];
    }
  }
}

}  // namespace

ReferenceParameters ReferenceParameters::From(const ParameterBlock& parameters) {
  ReferenceParameters p;
  p.rows = parameters.rows();
  p.count = static_cast<int>(parameters.count());
  for (int r = 0; r < p.rows; ++r) {
    p.values.insert(p.values.end(), parameters.Row(r), parameters.Row(r) + p.count);
  }
  return p;
}

void ReferenceRenderAt(const ReferenceParameters& parameters,
                       const ColorSpec& color,
                       const RasterCamera& camera,
                       const std::vector<double>& background,
                       double margin,
                       std::vector<ReferencePixel>& pixels) {
  const std::vector<Splat<double>> splats = ProjectSorted(parameters, color, camera);
  std::vector<Contribution> contributions;
  for (ReferencePixel& pixel : pixels) {
    const double t = Blend(splats, pixel.x, pixel.y, margin, contributions, &pixel.near_threshold);
    pixel.color = {};
    pixel.depth = 0.0;
    for (const Contribution& at : contributions) {
      const double weight = at.alpha * at.transmittance;
      for (int c = 0; c < color.channels; ++c) {
        pixel.color[c] += splats[at.splat].color[c] * weight;
      }
      pixel.depth += splats[at.splat].depth * weight;
    }
    for (int c = 0; c < color.channels; ++c) pixel.color[c] += background[c] * t;
    pixel.opacity = 1.0 - t;
  }
}

ReferenceImage ReferenceRender(const ReferenceParameters& parameters,
                               const ColorSpec& color,
                               const RasterCamera& camera,
                               const std::vector<double>& background) {
  std::vector<ReferencePixel> pixels(static_cast<size_t>(camera.width) * camera.height);
  for (size_t i = 0; i < pixels.size(); ++i) {
    pixels[i].x = static_cast<int>(i % camera.width);
    pixels[i].y = static_cast<int>(i / camera.width);
  }
  ReferenceRenderAt(parameters, color, camera, background, 0.0, pixels);
  ReferenceImage image;
  image.width = camera.width;
  image.height = camera.height;
  image.color.resize(color.channels);
  for (const ReferencePixel& pixel : pixels) {
    for (int c = 0; c < color.channels; ++c) image.color[c].push_back(pixel.color[c]);
    image.opacity.push_back(pixel.opacity);
    image.depth.push_back(pixel.depth);
  }
  return image;
}

ReferenceParameters ReferenceGradient(const ReferenceParameters& parameters,
                                      const ColorSpec& color,
                                      const RasterCamera& camera,
                                      const std::vector<double>& background,
                                      const std::vector<ReferencePixel>& pixels,
                                      const std::vector<std::array<double, 3>>& d_color) {
  const std::vector<Splat<double>> splats = ProjectSorted(parameters, color, camera);
  std::vector<ScreenGradient> screen(parameters.count);
  std::vector<Contribution> contributions;
  for (size_t k = 0; k < pixels.size(); ++k) {
    bool near_threshold = false;
    const double t = Blend(splats, pixels[k].x, pixels[k].y, 0.0, contributions, &near_threshold);
    BlendBackward(splats, contributions, color.channels, background, t, d_color[k], screen);
  }
  ReferenceParameters gradient = parameters;
  std::fill(gradient.values.begin(), gradient.values.end(), 0.0);
  for (int i = 0; i < parameters.count; ++i) {
    ProjectBackward(parameters, color, camera, i, screen[i], gradient);
  }
  return gradient;
}

double ReferenceCovarianceCondition(const ReferenceParameters& parameters,
                                    const RasterCamera& camera) {
  double worst = 1.0;
  ColorSpec none;
  none.channels = 0;
  for (int i = 0; i < parameters.count; ++i) {
    Splat<double> s;
    if (!Project(parameters, none, camera, i, s)) continue;
    // Eigenvalues: mean +- radius, and their product is the determinant 1 / det(conic).
    const double mean = 0.5 * (s.xx + s.yy);
    const double largest = mean + std::hypot(0.5 * (s.xx - s.yy), s.xy);
    const double det = s.yy / s.conic_xx;
    worst = std::max(worst, largest * largest / det);
  }
  return worst;
}

}  // namespace color3d
