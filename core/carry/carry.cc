#include "core/carry/carry.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/range_check.h"
#include "core/carry/confidence.h"
#include "core/image/optical_flow.h"
#include "core/image/plane_sampling.h"

namespace color3d {
namespace {

constexpr int kWindowRadius = 2;  // of the luminance comparison
constexpr double kNoise = 4.0;    // L units; weaker structure is grain

// Position of each target pixel in the source picture, px, and agreement of the depths there.
struct Correspondence {
  Image position;  // 2 channels (x, y), continuous; meaningless where visible is 0
  Image visible;   // 1 channel, 0..1
};

// Returns whether `pixel` lies between pixel centres, so that sampling does not extrapolate.
bool Inside(const Eigen::Vector2d& pixel, const Image& image) {
  return pixel.x() >= 0.5 && pixel.y() >= 0.5 && pixel.x() <= image.width - 0.5 &&
         pixel.y() <= image.height - 0.5;
}

// Samples at (x, y), with pixel centres at +0.5 as in Camera.
float Read(const Image& image, int channel, double x, double y) {
  return SampleBilinear(image, channel, x - 0.5, y - 0.5);
}

// Least relative difference of `depth` to the four source pixels around (x, y): edges of surfaces
// are a blend of two depths, so one agreeing neighbour is enough.
double DepthDisagreement(const Image& source_depth, double x, double y, double depth) {
  const int x0 = static_cast<int>(std::floor(x - 0.5)), y0 = static_cast<int>(std::floor(y - 0.5));
  double least = 1e9;
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      const int xi = std::clamp(x0 + dx, 0, source_depth.width - 1);
      const int yi = std::clamp(y0 + dy, 0, source_depth.height - 1);
      const double other = source_depth.At(0, yi, xi);
      if (other > 0.0) least = std::min(least, std::abs(other - depth) / depth);
    }
  }
  return least;
}

Correspondence Correspond(const SurfaceView& source, const SurfaceView& target, double tolerance) {
  const Camera& c = target.camera;
  Correspondence out{Image(c.width, c.height, 2), Image(c.width, c.height, 1)};
  const Eigen::Matrix3d world_from_cam =
      target.cam_from_world.rotation.conjugate().toRotationMatrix();
  const Eigen::Vector3d center = target.cam_from_world.Center();
  const Eigen::Matrix3d cam_from_world = source.cam_from_world.rotation.toRotationMatrix();
  for (int y = 0; y < c.height; ++y) {
    for (int x = 0; x < c.width; ++x) {
      const double depth = target.depth.At(0, y, x);
      if (!(depth > 0.0)) continue;
      const Eigen::Vector3d point = depth * c.Ray(x + 0.5, y + 0.5);
      const Eigen::Vector3d p =
          cam_from_world * (center + world_from_cam * point) + source.cam_from_world.translation;
      if (!(p.z() > 1e-6)) continue;
      const Eigen::Vector2d pixel = source.camera.Project(p);
      if (!Inside(pixel, source.luminance)) continue;
      const double e = DepthDisagreement(source.depth, pixel.x(), pixel.y(), p.z()) / tolerance;
      out.position.At(0, y, x) = static_cast<float>(pixel.x());
      out.position.At(1, y, x) = static_cast<float>(pixel.y());
      out.visible.At(0, y, x) = static_cast<float>(std::exp(-e * e));
    }
  }
  return out;
}

constexpr float kMinVisibility = static_cast<float>(kMinMatchProbability);
// Factor on the match probability of a pixel that is registered off the source's surfaces.
constexpr float kUnregistered = 0.3f;

// The source's L at the target's pixels; the target's own L where the source does not see them.
Image WarpedLuminance(const SurfaceView& source,
                      const SurfaceView& target,
                      const Correspondence& map) {
  Image warped = target.luminance;
  for (int y = 0; y < warped.height; ++y) {
    for (int x = 0; x < warped.width; ++x) {
      if (map.visible.At(0, y, x) < kMinVisibility) continue;
      warped.At(0, y, x) =
          Read(source.luminance, 0, map.position.At(0, y, x), map.position.At(1, y, x));
    }
  }
  return warped;
}

// Moves each correspondence along the flow between target and warped source, staying on surfaces
// that the source sees.
Correspondence Register(const Correspondence& map, const Image& flow, double tolerance_px) {
  Correspondence out = map;
  for (int y = 0; y < flow.height; ++y) {
    for (int x = 0; x < flow.width; ++x) {
      const double fx = flow.At(0, y, x), fy = flow.At(1, y, x);
      const double tx = x + 0.5 + fx, ty = y + 0.5 + fy;
      const int xi = static_cast<int>(std::floor(tx)), yi = static_cast<int>(std::floor(ty));
      if (xi < 0 || yi < 0 || xi >= flow.width || yi >= flow.height ||
          map.visible.At(0, yi, xi) < kMinVisibility) {
        out.visible.At(0, y, x) *= kUnregistered;
        continue;
      }
      // Within a pixel the map is followed linearly: position at the nearest pixel plus the rest.
      const double rx = tx - (xi + 0.5), ry = ty - (yi + 0.5);
      out.position.At(0, y, x) = map.position.At(0, yi, xi) + static_cast<float>(rx);
      out.position.At(1, y, x) = map.position.At(1, yi, xi) + static_cast<float>(ry);
      const double e2 = (fx * fx + fy * fy) / (tolerance_px * tolerance_px);
      out.visible.At(0, y, x) = map.visible.At(0, yi, xi) * static_cast<float>(std::exp(-e2));
    }
  }
  return out;
}

// Difference of two pictures in a window, which is clipped at the borders.
struct WindowDifference {
  double offset;     // difference of the means
  double structure;  // root mean square of the residual, over kNoise + that of the pictures
};

WindowDifference CompareWindows(const Image& a, const Image& b, int x, int y) {
  double sum_a = 0.0, sum_b = 0.0, sum_aa = 0.0, sum_bb = 0.0, sum_ab = 0.0;
  int count = 0;
  for (int yy = std::max(0, y - kWindowRadius); yy <= std::min(a.height - 1, y + kWindowRadius);
       ++yy) {
    for (int xx = std::max(0, x - kWindowRadius); xx <= std::min(a.width - 1, x + kWindowRadius);
         ++xx) {
      const double u = a.At(0, yy, xx), v = b.At(0, yy, xx);
      sum_a += u, sum_b += v, sum_aa += u * u, sum_bb += v * v, sum_ab += u * v;
      ++count;
    }
  }
  const double mean_a = sum_a / count, mean_b = sum_b / count;
  const double var_a = std::max(0.0, sum_aa / count - mean_a * mean_a);
  const double var_b = std::max(0.0, sum_bb / count - mean_b * mean_b);
  const double covariance = sum_ab / count - mean_a * mean_b;
  const double left = std::sqrt(std::max(0.0, var_a + var_b - 2.0 * covariance));
  return {mean_a - mean_b, left / (kNoise + std::sqrt(std::max(var_a, var_b)))};
}

void CheckSizes(const SurfaceView& view, const char* which) {
  for (const Image* image : {&view.luminance, &view.depth}) {
    if (image->channels != 1 || image->width != view.camera.width ||
        image->height != view.camera.height) {
      throw InvalidArgument("the {} view has a camera of {}x{} px, but a picture of {}x{}",
                            which,
                            view.camera.width,
                            view.camera.height,
                            image->width,
                            image->height);
    }
  }
}

}  // namespace

void CarryOptions::Validate() const {
  const RangeCheck check("carry option");
  check("depth_tolerance", depth_tolerance, 1e-4, 1.0);
  check("luminance_tolerance", luminance_tolerance, 1.0, 100.0);
  check("structure_tolerance", structure_tolerance, 1e-6, 1e6);
  if (flow_tolerance_px != 0.0) check("flow_tolerance_px", flow_tolerance_px, 0.1, 10.0);
}

CarriedColor CarryColor(const SurfaceView& source,
                        const Image& ab,
                        const Image& confidence,
                        const SurfaceView& target,
                        const CarryOptions& options) {
  options.Validate();
  CheckSizes(source, "source");
  CheckSizes(target, "target");
  Correspondence map = Correspond(source, target, options.depth_tolerance);
  if (options.flow_tolerance_px > 0.0) {
    const Image warped = WarpedLuminance(source, target, map);
    map = Register(map, DenseFlow(target.luminance, warped), options.flow_tolerance_px);
  }
  const Image warped = WarpedLuminance(source, target, map);
  const int width = target.camera.width, height = target.camera.height;
  CarriedColor out{Image(width, height, ab.channels), Image(width, height, 1)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double visible = map.visible.At(0, y, x);
      if (visible < kMinVisibility) continue;
      const double sx = map.position.At(0, y, x), sy = map.position.At(1, y, x);
      const WindowDifference d = CompareWindows(target.luminance, warped, x, y);
      const double offset = d.offset / options.luminance_tolerance;
      const double structure = d.structure / options.structure_tolerance;
      double c = visible * std::exp(-offset * offset - structure * structure);
      if (!confidence.Empty()) c *= Read(confidence, 0, sx, sy);
      out.confidence.At(0, y, x) = std::min(1.0f, static_cast<float>(c));
      for (int k = 0; k < ab.channels; ++k) out.ab.At(k, y, x) = Read(ab, k, sx, sy);
    }
  }
  return out;
}

void KeepMoreConfident(const CarriedColor& other, CarriedColor* color) {
  for (size_t i = 0; i < color->confidence.data.size(); ++i) {
    if (!(other.confidence.data[i] > color->confidence.data[i])) continue;
    color->confidence.data[i] = other.confidence.data[i];
    for (int c = 0; c < color->ab.channels; ++c) color->ab.Plane(c)[i] = other.ab.Plane(c)[i];
  }
}

void FillFrom(const CarriedColor& other, CarriedColor* color) {
  for (size_t i = 0; i < color->confidence.data.size(); ++i) {
    const float first = color->confidence.data[i];
    const float second = (1.0f - first) * other.confidence.data[i];
    const float sum = first + second;
    if (!(sum > 0.0f)) continue;
    for (int c = 0; c < color->ab.channels; ++c) {
      float& ab = color->ab.Plane(c)[i];
      ab = (first * ab + second * other.ab.Plane(c)[i]) / sum;
    }
    color->confidence.data[i] = std::min(1.0f, sum);  // rounding may exceed 1
  }
}

double Coverage(const CarriedColor& color, float least) {
  size_t covered = 0;
  for (float value : color.confidence.data) covered += value > least ? 1 : 0;
  return static_cast<double>(covered) / static_cast<double>(color.confidence.data.size());
}

Agreement AgreementOf(const Image& confidence) {
  Agreement agreement;
  for (float value : confidence.data) {
    if (!(value > static_cast<float>(kMinMatchProbability))) continue;
    agreement.confidence_sum += value;
    ++agreement.pixels;
  }
  return agreement;
}

double MeanAgreement(const std::vector<Agreement>& views) {
  Agreement all;
  for (const Agreement& view : views) {
    all.confidence_sum += view.confidence_sum;
    all.pixels += view.pixels;
  }
  return all.pixels > 0 ? all.confidence_sum / static_cast<double>(all.pixels) : 1.0;
}

}  // namespace color3d
