#include "core/splat/reference.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/splat/spherical_harmonics.h"

namespace color3d {
namespace {

struct Splat {
  double depth = 0.0;
  double u = 0.0, v = 0.0;
  double conic_xx = 0.0, conic_xy = 0.0, conic_yy = 0.0;
  double opacity = 0.0;
  double color[3] = {};
};

void Rotation(const ReferenceParameters& p, int i, double r[3][3]) {
  double q[4], norm = 1e-24;
  for (int k = 0; k < 4; ++k) {
    q[k] = p.At(kRotationRow + k, i);
    norm += q[k] * q[k];
  }
  for (double& v : q) v /= std::sqrt(norm);
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  const double values[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                               {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                               {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
  std::copy(&values[0][0], &values[0][0] + 9, &r[0][0]);
}

// M = J W R S.
void ScreenAxes(const ReferenceParameters& p,
                const RasterCamera& c,
                int i,
                const double cam[3],
                double m[2][3]) {
  double r[3][3];
  Rotation(p, i, r);
  const double margin_x = kFrustumMargin * 0.5 * c.width / c.fx;
  const double margin_y = kFrustumMargin * 0.5 * c.height / c.fy;
  const double tx =
      std::clamp(cam[0] / cam[2], -c.cx / c.fx - margin_x, (c.width - c.cx) / c.fx + margin_x);
  const double ty =
      std::clamp(cam[1] / cam[2], -c.cy / c.fy - margin_y, (c.height - c.cy) / c.fy + margin_y);
  const double jacobian[2][3] = {{c.fx / cam[2], 0.0, -c.fx * tx / cam[2]},
                                 {0.0, c.fy / cam[2], -c.fy * ty / cam[2]}};
  for (int row = 0; row < 2; ++row) {
    for (int k = 0; k < 3; ++k) {
      double sum = 0.0;
      for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
          sum += jacobian[row][a] * c.rotation[3 * a + b] * r[b][k];
        }
      }
      const double log_scale =
          std::clamp<double>(p.At(kLogScaleRow + k, i), kMinLogScale, kMaxLogScale);
      m[row][k] = sum * std::exp(log_scale);
    }
  }
}

void Color(const ReferenceParameters& p,
           const ColorSpec& color,
           const RasterCamera& c,
           int i,
           Splat& splat) {
  double d[3], norm = 1e-24;
  for (int k = 0; k < 3; ++k) {
    d[k] = p.At(kPositionRow + k, i) - c.center[k];
    norm += d[k] * d[k];
  }
  norm = std::sqrt(norm);
  double basis[kMaxShCoefficients];
  EvaluateSh(kMaxShCoefficients, d[0] / norm, d[1] / norm, d[2] / norm, basis);
  for (int ch = 0; ch < color.channels; ++ch) {
    double value = color.channel[ch].base;
    for (int k = 0; k < color.channel[ch].coefficients; ++k) {
      value += basis[k] * p.At(color.channel[ch].row + k, i);
    }
    splat.color[ch] = color.channel[ch].clamp_at_zero ? std::max(value, 0.0) : value;
  }
}

// False when the Gaussian is behind the near plane.
bool Project(const ReferenceParameters& p,
             const ColorSpec& color,
             const RasterCamera& c,
             int i,
             Splat& splat) {
  double cam[3];
  for (int a = 0; a < 3; ++a) {
    cam[a] = c.translation[a];
    for (int b = 0; b < 3; ++b) cam[a] += c.rotation[3 * a + b] * p.At(kPositionRow + b, i);
  }
  if (!(cam[2] > kNearPlane)) return false;
  splat.depth = cam[2];
  splat.u = c.fx * cam[0] / cam[2] + c.cx;
  splat.v = c.fy * cam[1] / cam[2] + c.cy;
  double m[2][3];
  ScreenAxes(p, c, i, cam, m);
  double xx = kCovarianceDilation, xy = 0.0, yy = kCovarianceDilation;
  for (int k = 0; k < 3; ++k) {
    xx += m[0][k] * m[0][k];
    xy += m[0][k] * m[1][k];
    yy += m[1][k] * m[1][k];
  }
  const double det = xx * yy - xy * xy;
  splat.conic_xx = yy / det;
  splat.conic_xy = -xy / det;
  splat.conic_yy = xx / det;
  splat.opacity = 1.0 / (1.0 + std::exp(-p.At(kOpacityRow, i)));
  Color(p, color, c, i, splat);
  return true;
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

ReferenceImage ReferenceRender(const ReferenceParameters& parameters,
                               const ColorSpec& color,
                               const RasterCamera& camera,
                               const std::vector<double>& background) {
  std::vector<Splat> splats;
  for (int i = 0; i < parameters.count; ++i) {
    Splat splat;
    if (Project(parameters, color, camera, i, splat)) splats.push_back(splat);
  }
  std::stable_sort(splats.begin(), splats.end(), [](const Splat& a, const Splat& b) {
    return a.depth < b.depth;
  });
  ReferenceImage image;
  image.width = camera.width;
  image.height = camera.height;
  const size_t pixels = static_cast<size_t>(camera.width) * camera.height;
  image.color.assign(color.channels, std::vector<double>(pixels, 0.0));
  image.opacity.assign(pixels, 0.0);
  image.depth.assign(pixels, 0.0);
  for (size_t pixel = 0; pixel < pixels; ++pixel) {
    const double px = static_cast<double>(pixel % camera.width) + 0.5;
    const double py = static_cast<double>(pixel / camera.width) + 0.5;
    double t = 1.0;
    for (const Splat& s : splats) {
      if (t < kMinTransmittance) break;
      const double dx = px - s.u, dy = py - s.v;
      const double power =
          -0.5 * (s.conic_xx * dx * dx + s.conic_yy * dy * dy) - s.conic_xy * dx * dy;
      const double alpha = std::min<double>(kMaxAlpha, s.opacity * std::exp(power));
      if (alpha < kMinAlpha) continue;
      for (int c = 0; c < color.channels; ++c) image.color[c][pixel] += s.color[c] * alpha * t;
      image.depth[pixel] += s.depth * alpha * t;
      t *= 1.0 - alpha;
    }
    for (int c = 0; c < color.channels; ++c) image.color[c][pixel] += background[c] * t;
    image.opacity[pixel] = 1.0 - t;
  }
  return image;
}

namespace {

// 11x11 Gaussian window, sigma 1.5, zeros outside.
double Blurred(const std::vector<double>& p, int width, int height, int x, int y) {
  double sum = 0.0, norm = 0.0;
  for (int dy = -5; dy <= 5; ++dy) {
    for (int dx = -5; dx <= 5; ++dx) {
      const double w = std::exp(-(dx * dx + dy * dy) / (2.0 * 1.5 * 1.5));
      norm += w;
      const int xx = x + dx, yy = y + dy;
      if (xx < 0 || yy < 0 || xx >= width || yy >= height) continue;
      sum += w * p[static_cast<size_t>(yy) * width + xx];
    }
  }
  return sum / norm;
}

std::vector<double> Product(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> p(a.size());
  for (size_t i = 0; i < a.size(); ++i) p[i] = a[i] * b[i];
  return p;
}

double DissimilaritySum(const std::vector<double>& x,
                        const std::vector<double>& y,
                        const std::vector<double>& weight,
                        int width,
                        int height) {
  const std::vector<double> xx = Product(x, x), xy = Product(x, y), yy = Product(y, y);
  double sum = 0.0;
  for (int r = 0; r < height; ++r) {
    for (int c = 0; c < width; ++c) {
      const double mx = Blurred(x, width, height, c, r), my = Blurred(y, width, height, c, r);
      const double sx = Blurred(xx, width, height, c, r) - mx * mx;
      const double sy = Blurred(yy, width, height, c, r) - my * my;
      const double sxy = Blurred(xy, width, height, c, r) - mx * my;
      const double ssim = (2 * mx * my + kSsimC1) * (2 * sxy + kSsimC2) /
                          ((mx * mx + my * my + kSsimC1) * (sx + sy + kSsimC2));
      const size_t i = static_cast<size_t>(r) * width + c;
      sum += (weight.empty() ? 1.0 : weight[i]) * (1.0 - ssim);
    }
  }
  return sum;
}

double EdgeMean(const std::vector<double>& x,
                const std::vector<double>& y,
                const std::vector<double>& weight,
                int width,
                int height) {
  if (width < 3 || height < 3) return 0.0;
  double sum = 0.0;
  for (int r = 1; r < height - 1; ++r) {
    for (int c = 1; c < width - 1; ++c) {
      const size_t i = static_cast<size_t>(r) * width + c;
      const auto laplacian = [&](const std::vector<double>& p) {
        return p[i - 1] + p[i + 1] + p[i - width] + p[i + width] - 4.0 * p[i];
      };
      const double d = laplacian(x) - laplacian(y);
      sum += (weight.empty() ? 1.0 : weight[i]) *
             std::sqrt(d * d + double{kCharbonnierEpsilon} * kCharbonnierEpsilon);
    }
  }
  return sum / (static_cast<double>(width - 2) * (height - 2));
}

}  // namespace

double ReferenceLoss(const std::vector<std::vector<double>>& x,
                     const std::vector<std::vector<double>>& y,
                     const std::vector<double>& weight,
                     int width,
                     int height,
                     const LossWeights& weights) {
  const double pixels = static_cast<double>(width) * height;
  double loss = 0.0;
  for (size_t c = 0; c < x.size(); ++c) {
    double l1 = 0.0;
    for (size_t i = 0; i < x[c].size(); ++i) {
      l1 += (weight.empty() ? 1.0 : weight[i]) * std::abs(x[c][i] - y[c][i]);
    }
    loss += weights.l1 * l1 / pixels;
    loss += weights.ssim * DissimilaritySum(x[c], y[c], weight, width, height) / pixels;
    loss += weights.edge * EdgeMean(x[c], y[c], weight, width, height);
  }
  return loss / static_cast<double>(x.size());
}

}  // namespace color3d
