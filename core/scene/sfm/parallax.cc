#include "core/scene/sfm/parallax.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/base/median.h"
#include "core/base/random.h"
#include "core/image/feature_matches.h"

namespace color3d {
namespace {

constexpr int kMaxPhotos = 60;
constexpr size_t kMaxPairs = 400;
// Minimum number of matches; features of unrelated photos match by chance.
constexpr int kMinMatches = 20;
constexpr double kTolerance = 0.004;  // fraction of the longer side
constexpr int kSamples = 40;          // samples of two matches for each focal length
// Fractions of the longer side; the best one is then refined by ratios.
constexpr std::array<double, 5> kFocalLengths = {0.6, 0.9, 1.3, 2.0, 3.5};
constexpr std::array<double, 3> kRefinements = {1.2, 1.09, 1.04};
// The other matches may be of moving objects, or wrong.
constexpr double kTurnedShare = 0.7;  // fraction of a pair's matches
constexpr double kTurnedPairs = 0.9;
constexpr double kMatchedPairs = 0.2;
constexpr double kOnePlace = 0.8;  // fraction of the photos

using Points = Eigen::Matrix2Xd;

// Matched features relative to the centre of the picture, in fractions of its longer side.
struct Matched {
  Points a, b;
};

Matched MatchedPoints(const LocalFeatures& a, const LocalFeatures& b) {
  const auto matches = MutualMatches(a, b);
  Matched out{Points(2, matches.size()), Points(2, matches.size())};
  for (size_t i = 0; i < matches.size(); ++i) {
    const auto [first, second] = matches[i];
    for (int c = 0; c < 2; ++c) {
      out.a(c, i) = a.positions[2 * first + c] / a.side_px;
      out.b(c, i) = b.positions[2 * second + c] / b.side_px;
    }
  }
  return out;
}

Eigen::Matrix3Xd Rays(const Points& points, double focal) {
  Eigen::Matrix3Xd rays(3, points.cols());
  rays.topRows<2>() = points / focal;
  rays.row(2).setOnes();
  rays.colwise().normalize();
  return rays;
}

// Rotation that best aligns the rays of `a` with those of `b` (Kabsch 1976).
Eigen::Matrix3d Rotation(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(b * a.transpose(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d sign = Eigen::Matrix3d::Identity();
  sign(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  return svd.matrixU() * sign * svd.matrixV().transpose();
}

// Matches that the rotation explains.
std::vector<int> Inliers(const Matched& points,
                         const Eigen::Matrix3Xd& rays,
                         const Eigen::Matrix3d& rotation,
                         double focal) {
  std::vector<int> explained;
  const Eigen::Matrix3Xd turned = rotation * rays;
  for (int i = 0; i < turned.cols(); ++i) {
    if (!(turned(2, i) > 0.0)) continue;
    const Eigen::Vector2d at = focal * turned.col(i).head<2>() / turned(2, i);
    if ((at - points.b.col(i)).norm() < kTolerance) explained.push_back(i);
  }
  return explained;
}

int MaxInliers(const Matched& points, double focal, Random* random) {
  const Eigen::Matrix3Xd from = Rays(points.a, focal), to = Rays(points.b, focal);
  const auto count = static_cast<uint32_t>(from.cols());
  std::vector<int> best;
  for (int s = 0; s < kSamples; ++s) {
    const std::array<int, 2> sample = {static_cast<int>(random->NextBelow(count)),
                                       static_cast<int>(random->NextBelow(count))};
    if (sample[0] == sample[1]) continue;
    std::vector<int> explained =
        Inliers(points, from, Rotation(from(Eigen::all, sample), to(Eigen::all, sample)), focal);
    if (explained.size() > best.size()) best = std::move(explained);
  }
  if (best.size() < 3) return static_cast<int>(best.size());
  const Eigen::Matrix3d refined = Rotation(from(Eigen::all, best), to(Eigen::all, best));
  return static_cast<int>(std::max(best.size(), Inliers(points, from, refined, focal).size()));
}

// Groups of photos that are connected by pairs with pure rotation.
class Groups {
 public:
  explicit Groups(int count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  void Join(int i, int j) { parent_[Find(i)] = Find(j); }
  int Largest() {
    std::vector<int> sizes(parent_.size(), 0);
    for (size_t i = 0; i < parent_.size(); ++i) ++sizes[Find(static_cast<int>(i))];
    return sizes.empty() ? 0 : *std::ranges::max_element(sizes);
  }

 private:
  int Find(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  std::vector<int> parent_;
};

}  // namespace

PairMotion MeasureMotion(const LocalFeatures& a, const LocalFeatures& b) {
  const Matched points = MatchedPoints(a, b);
  PairMotion motion;
  motion.matches = static_cast<int>(points.a.cols());
  if (motion.matches < 2) return motion;
  std::vector<double> shifts;
  for (int i = 0; i < motion.matches; ++i) {
    shifts.push_back((points.a.col(i) - points.b.col(i)).norm());
  }
  motion.median_shift = Median(std::move(shifts));
  Random random(1);
  int most = 0;
  double best = kFocalLengths[0];
  const auto offer = [&](double focal) {
    const int explained = MaxInliers(points, focal, &random);
    if (explained <= most) return;
    most = explained;
    best = focal;
  };
  for (const double focal : kFocalLengths) offer(focal);
  for (const double ratio : kRefinements) {
    const double around = best;
    offer(around / ratio);
    offer(around * ratio);
  }
  motion.turned = static_cast<double>(most) / motion.matches;
  return motion;
}

bool ParallaxEvidence::IsFromOnePlace() const {
  return photos >= 3 && matched >= 3 && matched >= kMatchedPairs * pairs &&
         turned >= kTurnedPairs * matched && largest_place >= kOnePlace * photos;
}

ParallaxEvidence MeasureParallax(const std::vector<LocalFeatures>& photos,
                                 ThreadPool& pool,
                                 const CancellationToken& cancel) {
  ParallaxEvidence evidence;
  const int count = static_cast<int>(photos.size());
  evidence.photos = std::min(count, kMaxPhotos);
  std::vector<std::pair<int, int>> all, pairs;
  for (int i = 0; i < evidence.photos; ++i) {
    for (int j = i + 1; j < evidence.photos; ++j) all.emplace_back(i, j);
  }
  const size_t wanted = std::min(all.size(), kMaxPairs);
  for (size_t k = 0; k < wanted; ++k) pairs.push_back(all[k * all.size() / wanted]);
  evidence.pairs = static_cast<int>(pairs.size());
  const auto photo = [&](int i) -> const LocalFeatures& {
    return photos[static_cast<size_t>(i) * count / evidence.photos];
  };
  std::vector<PairMotion> motions(pairs.size());
  pool.ForEach(evidence.pairs, [&](int64_t k, int) {
    cancel.ThrowIfCancelled();
    motions[k] = MeasureMotion(photo(pairs[k].first), photo(pairs[k].second));
  });
  Groups places(evidence.photos);
  std::vector<double> shifts;
  for (size_t k = 0; k < pairs.size(); ++k) {
    if (motions[k].matches < kMinMatches) continue;
    ++evidence.matched;
    shifts.push_back(motions[k].median_shift);
    if (motions[k].turned < kTurnedShare) continue;
    ++evidence.turned;
    places.Join(pairs[k].first, pairs[k].second);
  }
  if (!shifts.empty()) evidence.median_shift = Median(std::move(shifts));
  evidence.largest_place = places.Largest();
  return evidence;
}

std::string Describe(const ParallaxEvidence& e) {
  return fmt::format(
      "{} of {} overlapping pairs of photos differ by a rotation of the camera only (median shift "
      "{:.1f} % of the longer side), which connects {} of {} photos to one place",
      e.turned,
      e.matched,
      100.0 * e.median_shift,
      e.largest_place,
      e.photos);
}

}  // namespace color3d
