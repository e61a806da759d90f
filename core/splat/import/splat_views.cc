#include "core/splat/import/splat_views.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "core/base/error.h"
#include "core/base/range_check.h"
#include "core/splat/import/seen_gaussians.h"

namespace color3d {
namespace {

constexpr size_t kPlaceSample = 200'000;
constexpr int kCoarseDirections = 60;
constexpr int kFineDirections = 600;
constexpr double kDistances[] = {0.35, 0.6, 1.0, 1.6, 2.5, 4.0};  // radii from the center
// A direction is good if its best distance shows this share of the best direction's.
constexpr double kGoodShare = 0.75;
// Keeps the distance of the best direction if another one shows little more.
constexpr double kSameDistanceShare = 0.85;
// Cameras are usually above the ground: factor for views from more than 25 degrees below.
constexpr double kBelow = -0.42, kBelowShare = 0.6;
constexpr double kFocalShare = 0.9;  // of the picture's width: 58 degrees across
constexpr double kAspect = 0.75;
constexpr double kWholeTurn = 6.283185307179586;

double MedianOf(std::vector<std::pair<double, double>>* weighted) {
  std::sort(weighted->begin(), weighted->end());
  double all = 0.0, before = 0.0;
  for (const auto& [value, weight] : *weighted) all += weight;
  for (const auto& [value, weight] : *weighted) {
    before += weight;
    if (before >= 0.5 * all) return value;
  }
  return 0.0;
}

// Spread evenly over the sphere (spherical Fibonacci lattice).
std::vector<Eigen::Vector3d> Directions(int count) {
  const double golden = 0.5 * kWholeTurn * (3.0 - std::sqrt(5.0));
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count, r = std::sqrt(1.0 - z * z);
    directions.emplace_back(r * std::cos(golden * i), r * std::sin(golden * i), z);
  }
  return directions;
}

Camera PictureOf(int side_px) {
  Camera camera;
  camera.width = side_px;
  camera.height = static_cast<int>(std::lround(kAspect * side_px));
  camera.fx = camera.fy = kFocalShare * side_px;
  camera.cx = 0.5 * camera.width;
  camera.cy = 0.5 * camera.height;
  return camera;
}

// At center + distance * direction, looking at the center, `up` upwards in the picture.
Pose LookingAt(const Eigen::Vector3d& center,
               const Eigen::Vector3d& direction,
               double distance,
               const Eigen::Vector3d& up) {
  const Eigen::Vector3d forward = -direction;
  Eigen::Vector3d right = forward.cross(up);
  if (right.norm() < 1e-3) right = forward.cross(up.unitOrthogonal());
  right.normalize();
  Eigen::Matrix3d rows;
  rows.row(0) = right;
  rows.row(1) = forward.cross(right);  // down
  rows.row(2) = forward;
  Pose pose;
  pose.rotation = Eigen::Quaterniond(rows).normalized();
  pose.translation = -(pose.rotation * (center + distance * direction));
  return pose;
}

struct Candidate {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double distance = 0.0;
  double seen = 0.0;
};

class CameraChooser {
 public:
  CameraChooser(const GaussianModel& model,
                const SplatExtent& extent,
                const SplatViewOptions& options,
                const RunControl& run)
      : extent_(extent),
        options_(options),
        run_(run),
        picture_(PictureOf(options.side_px)),
        seen_(model, picture_, run.pool),
        up_(EstimateUp(model, options.up)) {}

  std::vector<SplatCamera> Choose() {
    ScoreCoarseCandidates();
    const Candidate best = *std::max_element(
        coarse_.begin(), coarse_.end(), [](const Candidate& a, const Candidate& b) {
          return a.seen < b.seen;
        });
    if (!(best.seen > 0.0)) {
      throw InvalidArgument(
          "the splat cannot be seen from anywhere: its Gaussians are too faint or too small");
    }
    PreferOneDistance(best.distance);
    return Spread(best);
  }

 private:
  double Score(const Candidate& candidate) {
    run_.cancel.ThrowIfCancelled();
    const Pose pose = LookingAt(extent_.center, candidate.direction, candidate.distance, up_);
    const SeenGaussians::Measure m = seen_.At(pose, candidate.distance);
    const double below = candidate.direction.dot(up_) < kBelow ? kBelowShare : 1.0;
    return below * m.seen * (0.25 + 0.75 * m.covered) * std::max(0.0, 1.0 - 3.0 * m.near);
  }

  // The best distance of each coarse direction.
  void ScoreCoarseCandidates() {
    const std::vector<Eigen::Vector3d> directions = Directions(kCoarseDirections);
    for (const Eigen::Vector3d& direction : directions) {
      Candidate best{direction, extent_.radius, 0.0};
      for (const double distance : kDistances) {
        Candidate candidate{direction, distance * extent_.radius, 0.0};
        candidate.seen = Score(candidate);
        if (candidate.seen > best.seen) best = candidate;
      }
      coarse_.push_back(best);
      run_.progress.OnProgress(static_cast<int64_t>(coarse_.size()),
                               kCoarseDirections + options_.views,
                               "looking for views");
    }
  }

  void PreferOneDistance(double distance) {
    for (Candidate& coarse : coarse_) {
      const Candidate same{coarse.direction, distance, 0.0};
      const double seen = coarse.distance == distance ? coarse.seen : Score(same);
      if (seen >= kSameDistanceShare * coarse.seen) coarse = {coarse.direction, distance, seen};
    }
  }

  const Candidate& NearestCoarse(const Eigen::Vector3d& direction) const {
    return *std::max_element(
        coarse_.begin(), coarse_.end(), [&](const Candidate& a, const Candidate& b) {
          return a.direction.dot(direction) < b.direction.dot(direction);
        });
  }

  // Among the good fine directions, selects the one farthest from the selected ones.
  std::vector<SplatCamera> Spread(const Candidate& best) {
    std::vector<Candidate> fine;
    for (const Eigen::Vector3d& direction : Directions(kFineDirections)) {
      const Candidate& near = NearestCoarse(direction);
      if (near.seen >= kGoodShare * best.seen) fine.push_back({direction, near.distance, 0.0});
    }
    std::vector<SplatCamera> chosen;
    std::vector<double> far(fine.size(), 2.0);
    const auto take = [&](const Candidate& c) {
      chosen.push_back({picture_,
                        LookingAt(extent_.center, c.direction, c.distance, up_),
                        std::min(1.0, c.seen / best.seen)});
      for (size_t i = 0; i < fine.size(); ++i) {
        far[i] = std::min(far[i], 1.0 - fine[i].direction.dot(c.direction));
      }
    };
    take(best);
    while (static_cast<int>(chosen.size()) < options_.views) {
      const auto next = std::max_element(far.begin(), far.end());
      if (next == far.end() || !(*next > 1e-9)) break;
      Candidate& candidate = fine[static_cast<size_t>(next - far.begin())];
      candidate.seen = Score(candidate);
      *next = 0.0;
      if (candidate.seen >= kGoodShare * best.seen) take(candidate);
      run_.progress.OnProgress(kCoarseDirections + static_cast<int64_t>(chosen.size()),
                               kCoarseDirections + options_.views,
                               "looking for views");
    }
    return SortAlongPath(std::move(chosen));
  }

  // Orders views by proximity, so that consecutive names are neighbours.
  static std::vector<SplatCamera> SortAlongPath(std::vector<SplatCamera> cameras) {
    for (size_t i = 1; i < cameras.size(); ++i) {
      const Eigen::Vector3d last = cameras[i - 1].cam_from_world.Center();
      const auto nearest = std::min_element(cameras.begin() + static_cast<std::ptrdiff_t>(i),
                                            cameras.end(),
                                            [&](const SplatCamera& a, const SplatCamera& b) {
                                              return (a.cam_from_world.Center() - last).norm() <
                                                     (b.cam_from_world.Center() - last).norm();
                                            });
      std::iter_swap(cameras.begin() + static_cast<std::ptrdiff_t>(i), nearest);
    }
    return cameras;
  }

  const SplatExtent extent_;
  const SplatViewOptions& options_;
  const RunControl& run_;
  const Camera picture_;
  SeenGaussians seen_;
  std::vector<Candidate> coarse_;
  const Eigen::Vector3d up_;
};

}  // namespace

void SplatViewOptions::Validate() const {
  const RangeCheck check("splat view option");
  check("views", views, 2, 200);
  check("side_px", side_px, 64, 4096);
}

SplatExtent FindSplatExtent(const GaussianModel& model) {
  std::vector<size_t> sample = SpreadSample(model, kPlaceSample);
  if (sample.empty()) {
    sample.resize(model.size());
    std::iota(sample.begin(), sample.end(), size_t{0});
  }
  std::vector<Ellipsoid> ellipsoids;
  for (const size_t i : sample) ellipsoids.push_back(EllipsoidOf(model, i));
  SplatExtent extent;
  std::vector<std::pair<double, double>> values(ellipsoids.size());
  for (int k = 0; k < 3; ++k) {
    for (size_t i = 0; i < values.size(); ++i) {
      values[i] = {ellipsoids[i].center[k], ellipsoids[i].opacity};
    }
    extent.center[k] = MedianOf(&values);
  }
  double largest = 0.0;
  for (size_t i = 0; i < values.size(); ++i) {
    values[i] = {(ellipsoids[i].center - extent.center).norm(), ellipsoids[i].opacity};
    largest = std::max(largest, ellipsoids[i].radius[2]);
  }
  extent.radius = MedianOf(&values);
  // One Gaussian, or several at one position: uses their own size.
  if (!(extent.radius > 1e-6 * largest)) extent.radius = std::max(largest, 1e-9);
  return extent;
}

std::vector<SplatCamera> ChooseSplatCameras(const GaussianModel& model,
                                            const SplatExtent& extent,
                                            const SplatViewOptions& options,
                                            const RunControl& run) {
  options.Validate();
  return CameraChooser(model, extent, options, run).Choose();
}

Eigen::Vector3d EstimateUp(const GaussianModel& model, SplatUp about) {
  // Normals of flat Gaussians vote for the axes near which they lie.
  constexpr size_t kVoters = 20'000;
  constexpr double kFlat = 0.3, kClearly = 1.5;
  const std::vector<Eigen::Vector3d> axes = Directions(kFineDirections);
  const Eigen::Vector3d custom = about == SplatUp::kMinusY ? Eigen::Vector3d(0.0, -1.0, 0.0)
                                 : about == SplatUp::kY    ? Eigen::Vector3d(0.0, 1.0, 0.0)
                                                           : Eigen::Vector3d(0.0, 0.0, 1.0);
  std::vector<double> votes(axes.size(), 0.0);
  double all = 0.0;
  for (const size_t i : SpreadSample(model, kVoters)) {
    const Ellipsoid e = EllipsoidOf(model, i);
    if (e.radius[0] > kFlat * e.radius[1]) continue;
    const double weight = e.opacity;
    all += weight;
    for (size_t k = 0; k < axes.size(); ++k) {
      votes[k] += weight * std::pow(e.axes.col(0).dot(axes[k]), 32.0);
    }
  }
  const double mean = all / 33.0;  // share of each axis for evenly spread normals
  std::optional<size_t> top;
  for (size_t k = 0; k < axes.size(); ++k) {
    if (axes[k].dot(custom) < 0.5) continue;
    if (!top || votes[k] > votes[*top]) top = k;
  }
  if (!top || votes[*top] < kClearly * mean) return custom;
  return axes[*top];
}

}  // namespace color3d
