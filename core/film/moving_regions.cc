#include "core/film/moving_regions.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/median.h"
#include "core/base/mutex.h"
#include "core/image/box_mean.h"
#include "core/image/optical_flow.h"
#include "core/image/plane_sampling.h"

namespace color3d {
namespace {

constexpr int kDistances[] = {1, 2, 4, 8};
constexpr float kMaxCyclePx = 1.0f;  // forward-backward error
constexpr float kMinTexture = 0.4f;  // mean gradient of samples, L per px
constexpr int kSampleStepPx = 6;
constexpr size_t kMinSamples = 100;
constexpr double kStillPx = 0.3;
constexpr double kMinMotionPx = 1.0;
constexpr double kNoiseFactor = 4.0 * 1.4826;  // four standard deviations, from a median
// A homography that explains nearly as much as a fundamental matrix is preferred, since the matrix
// may explain moving objects, too.
constexpr double kTurnShare = 0.9;

struct Flow {
  Image there;                 // px
  std::vector<char> reliable;  // per pixel
  std::vector<int> sample;     // indices of reliable pixels with texture, on a grid
  Image texture;               // 1 channel, L per px
};

// Mean length of the gradient over 7 px.
Image Texture(const Image& luminance) {
  const Image smooth = BoxMean(luminance, 1);
  Image gradient(luminance.width, luminance.height, 1);
  for (int y = 1; y + 1 < gradient.height; ++y) {
    for (int x = 1; x + 1 < gradient.width; ++x) {
      gradient.At(0, y, x) = 0.5f * std::hypot(smooth.At(0, y, x + 1) - smooth.At(0, y, x - 1),
                                               smooth.At(0, y + 1, x) - smooth.At(0, y - 1, x));
    }
  }
  return BoxMean(gradient, 3);
}

// Reliable flow of `from`. `there`: from it to the other frame; `back`: from that one.
Flow ReliableFlow(const Image& from, const Image& there, const Image& back) {
  Flow flow{there, std::vector<char>(from.PlaneSize(), 0), {}, Texture(from)};
  for (int y = 0; y < from.height; ++y) {
    for (int x = 0; x < from.width; ++x) {
      const float u = flow.there.At(0, y, x), v = flow.there.At(1, y, x);
      const float tx = static_cast<float>(x) + u, ty = static_cast<float>(y) + v;
      if (tx < 0 || ty < 0 || tx > from.width - 1 || ty > from.height - 1) continue;
      const float cycle =
          std::hypot(u + SampleBilinear(back, 0, tx, ty), v + SampleBilinear(back, 1, tx, ty));
      if (!(cycle < kMaxCyclePx)) continue;
      const int at = y * from.width + x;
      flow.reliable[at] = 1;
      const bool on_grid =
          x % kSampleStepPx == kSampleStepPx / 2 && y % kSampleStepPx == kSampleStepPx / 2;
      if (on_grid && flow.texture.data[at] > kMinTexture) flow.sample.push_back(at);
    }
  }
  return flow;
}

// A model of the camera's motion between two frames.
struct CameraModel {
  cv::Matx33d matrix;
  CameraMotion motion;

  // Distance in px between the position to which `flow` moves pixel `at` and the model's: the
  // homography's position, or Sampson's distance from the epipolar lines.
  double Residual(const Image& flow, int at) const {
    const double x = at % flow.width, y = at / flow.width;
    const double tx = x + flow.Plane(0)[at], ty = y + flow.Plane(1)[at];
    const cv::Vec3d p(x, y, 1.0), q(tx, ty, 1.0);
    const cv::Vec3d l = matrix * p;
    if (motion != CameraMotion::kMoved) {
      return std::abs(l[2]) < 1e-9 ? 1e3 : std::hypot(l[0] / l[2] - tx, l[1] / l[2] - ty);
    }
    const cv::Vec3d m = matrix.t() * q;
    const double slope = l[0] * l[0] + l[1] * l[1] + m[0] * m[0] + m[1] * m[1];
    return std::abs(q.dot(l)) / std::sqrt(slope + 1e-18);
  }
};

std::vector<double> SampleResiduals(const CameraModel& model, const Flow& flow) {
  std::vector<double> residuals;
  for (const int at : flow.sample) residuals.push_back(model.Residual(flow.there, at));
  return residuals;
}

double ShareBelow(const std::vector<double>& values, double limit) {
  const auto below =
      std::count_if(values.begin(), values.end(), [&](double v) { return v < limit; });
  return static_cast<double>(below) / static_cast<double>(values.size());
}

// Fits a model; nothing when none explains the flow.
std::optional<CameraModel> Explain(const Flow& flow) {
  std::vector<cv::Point2d> from, to;
  const int width = flow.there.width;
  for (const int at : flow.sample) {
    const double x = at % width, y = at / width;
    from.emplace_back(x, y);
    to.emplace_back(x + flow.there.Plane(0)[at], y + flow.there.Plane(1)[at]);
  }
  std::optional<CameraModel> turn, moved;
  try {
    constexpr int kIterations = 2000;
    constexpr double kConfidence = 0.999;
    const cv::Mat h = cv::findHomography(
        from, to, cv::USAC_MAGSAC, kMinMotionPx, cv::noArray(), kIterations, kConfidence);
    if (h.rows == 3) turn = {cv::Matx33d(h), CameraMotion::kTurn};
    // Least median of squares takes the matrix that explains the larger half best. A count of
    // inliers could prefer one that explains moving objects, too.
    const cv::Mat f = cv::findFundamentalMat(
        from, to, cv::FM_LMEDS, kMinMotionPx, kConfidence, kIterations, cv::noArray());
    if (f.rows == 3) moved = {cv::Matx33d(f), CameraMotion::kMoved};
  } catch (const cv::Exception& e) {
    throw Error(ErrorCode::kInternal, "estimating the motion of the camera failed: {}", e.err);
  }
  if (!turn || !moved) return moved ? moved : turn;
  const double by_turn = ShareBelow(SampleResiduals(*turn, flow), kMinMotionPx);
  const double by_move = ShareBelow(SampleResiduals(*moved, flow), kMinMotionPx);
  return by_turn >= kTurnShare * by_move ? turn : moved;
}

double MedianLength(const Flow& flow) {
  std::vector<double> lengths;
  for (const int at : flow.sample) {
    lengths.push_back(std::hypot(flow.there.Plane(0)[at], flow.there.Plane(1)[at]));
  }
  return Median(std::move(lengths));
}

double MedianTexture(const Flow& flow) {
  std::vector<double> texture;
  for (const int at : flow.sample) texture.push_back(flow.texture.data[at]);
  return Median(std::move(texture));
}

PairResidual Compare(const Image& from, const Image& there, const Image& back) {
  PairResidual result;
  result.excess = Image(from.width, from.height, 1, -1.0f);
  const Flow flow = ReliableFlow(from, there, back);
  if (flow.sample.size() < kMinSamples) return result;
  result.background_px = MedianLength(flow);
  const std::optional<CameraModel> model =
      result.background_px < kStillPx ? CameraModel{cv::Matx33d::eye(), CameraMotion::kStill}
                                      : Explain(flow);
  if (!model) return result;
  result.motion = model->motion;
  const double noise_px = kNoiseFactor * Median(SampleResiduals(*model, flow));
  const double texture = MedianTexture(flow);
  for (int at = 0; at < static_cast<int>(flow.reliable.size()); ++at) {
    if (!flow.reliable[at]) continue;
    // The error of flow is inversely proportional to the gradient.
    const double plain = texture / std::max(flow.texture.data[at], 0.05f * kMinTexture);
    result.excess.data[at] = static_cast<float>(
        model->Residual(flow.there, at) / std::max(kMinMotionPx, noise_px * std::max(1.0, plain)));
  }
  return result;
}

// Votes of the neighbours of one frame, per pixel; empty before the first vote.
struct Votes {
  std::vector<uint8_t> moving, all;
};

void Add(const PairResidual& pair, Votes* votes) {
  votes->moving.resize(pair.excess.data.size());
  votes->all.resize(pair.excess.data.size());
  for (size_t i = 0; i < votes->all.size(); ++i) {
    const float excess = pair.excess.data[i];
    if (excess < 0.0f) continue;
    ++votes->all[i];
    if (excess > 1.0f) ++votes->moving[i];
  }
}

// Fills holes of moving regions, where weak texture gives no flow.
void FillHoles(cv::Mat* regions) {
  constexpr double kLargestShare = 0.01;  // of the picture
  std::vector<std::vector<cv::Point>> outlines;
  std::vector<cv::Vec4i> hierarchy;
  cv::findContours(*regions, outlines, hierarchy, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  for (size_t i = 0; i < outlines.size(); ++i) {
    const bool is_hole = hierarchy[i][3] >= 0;
    if (!is_hole || cv::contourArea(outlines[i]) > kLargestShare * regions->total()) continue;
    cv::drawContours(*regions, outlines, static_cast<int>(i), cv::Scalar(1), cv::FILLED);
  }
}

// Regions by majority vote, without specks and holes, dilated over the soft edges of the flow.
Image VotedRegions(const Votes& votes, int least_votes, int width, int height) {
  cv::Mat moving(height, width, CV_8U);
  for (size_t i = 0; i < votes.all.size(); ++i) {
    moving.data[i] = votes.all[i] >= least_votes && 2 * votes.moving[i] > votes.all[i];
  }
  const auto disc = [](int side) {
    return cv::getStructuringElement(cv::MORPH_ELLIPSE, cv::Size(side, side));
  };
  const int unit = std::max(1, std::max(width, height) / 160);
  cv::morphologyEx(moving, moving, cv::MORPH_OPEN, disc(2 * (unit / 2) + 1));
  cv::morphologyEx(moving, moving, cv::MORPH_CLOSE, disc(4 * unit + 1));
  cv::dilate(moving, moving, disc(2 * unit + 1));
  FillHoles(&moving);
  Image image(width, height, 1);
  moving.convertTo(cv::Mat(height, width, CV_32F, image.data.data()), CV_32F);
  return image;
}

int NeighborCount(int frame, int count) {
  int neighbors = 0;
  for (const int distance : kDistances) {
    neighbors += (frame >= distance ? 1 : 0) + (frame + distance < count ? 1 : 0);
  }
  return neighbors;
}

// Pairs of the frames from `begin` to `end` with the neighbours after them.
std::vector<std::pair<int, int>> NeighborPairs(int begin, int end, int count) {
  std::vector<std::pair<int, int>> pairs;
  for (int frame = begin; frame < end; ++frame) {
    for (const int distance : kDistances) {
      if (frame + distance < count) pairs.emplace_back(frame, frame + distance);
    }
  }
  return pairs;
}

// Pairs of frames spread over the shot: each with the next frame, and with one another.
std::vector<std::pair<int, int>> SpreadPairs(int count) {
  constexpr int kPlaces = 6;
  std::set<int> places;
  for (int i = 0; i < kPlaces; ++i) places.insert(i * (count - 1) / (kPlaces - 1));
  std::set<std::pair<int, int>> pairs;
  for (const int a : places) {
    if (a + 1 < count) pairs.emplace(a, a + 1);
    for (const int b : places) {
      if (a < b) pairs.emplace(a, b);
    }
  }
  return {pairs.begin(), pairs.end()};
}

}  // namespace

PairResidual CompareFrames(const Image& from, const Image& to) {
  return Compare(from, DenseFlow(from, to), DenseFlow(to, from));
}

ShotMotion MeasureCameraMotion(const ShotFrames& frames,
                               ThreadPool& pool,
                               const CancellationToken& cancel) {
  const std::vector<std::pair<int, int>> pairs = SpreadPairs(frames.count);
  std::vector<double> shift(pairs.size(), -1.0);
  pool.ForEach(static_cast<int64_t>(pairs.size()), [&](int64_t i, int) {
    cancel.ThrowIfCancelled();
    const auto from = frames.luminance(pairs[i].first), to = frames.luminance(pairs[i].second);
    const Flow flow = ReliableFlow(*from, DenseFlow(*from, *to), DenseFlow(*to, *from));
    if (flow.sample.size() >= kMinSamples) shift[i] = MedianLength(flow);
  });
  std::erase_if(shift, [](double px) { return px < 0.0; });
  ShotMotion motion;
  motion.pairs = static_cast<int>(shift.size());
  if (shift.empty()) return motion;
  motion.background_px = Median(shift);
  motion.camera_stands_still = ShareBelow(shift, kStillPx) >= 0.9;
  return motion;
}

ShotMotion FindMovingRegions(const ShotFrames& frames,
                             ThreadPool& pool,
                             const CancellationToken& cancel,
                             const std::function<void(int frame, const Image& moving)>& on_frame) {
  constexpr int kAtOnce = 16;  // frames; bounds memory
  ShotMotion motion = MeasureCameraMotion(frames, pool, cancel);
  Mutex adding, handing_over;
  std::vector<Votes> votes(frames.count);
  std::vector<double> share(frames.count, 0.0);
  for (int begin = 0; begin < frames.count; begin += kAtOnce) {
    const int end = std::min(begin + kAtOnce, frames.count);
    const std::vector<std::pair<int, int>> pairs = NeighborPairs(begin, end, frames.count);
    // One pair of flows gives votes for both frames.
    pool.ForEach(static_cast<int64_t>(pairs.size()), [&](int64_t i, int) {
      cancel.ThrowIfCancelled();
      const auto [earlier, later] = pairs[i];
      const auto before = frames.luminance(earlier), behind = frames.luminance(later);
      const Image forth = DenseFlow(*before, *behind), back = DenseFlow(*behind, *before);
      const PairResidual of_earlier = Compare(*before, forth, back);
      const PairResidual of_later = Compare(*behind, back, forth);
      const MutexLock lock(adding);
      Add(of_earlier, &votes[earlier]);
      Add(of_later, &votes[later]);
    });
    // All votes for these frames are in.
    pool.ForEach(end - begin, [&](int64_t i, int) {
      const int frame = begin + static_cast<int>(i);
      const auto picture = frames.luminance(frame);
      Votes frame_votes = std::exchange(votes[frame], {});
      frame_votes.moving.resize(picture->PlaneSize());
      frame_votes.all.resize(picture->PlaneSize());
      const int least = std::clamp(NeighborCount(frame, frames.count), 1, 2);
      const Image moving = VotedRegions(frame_votes, least, picture->width, picture->height);
      double sum = 0.0;
      for (const float v : moving.data) sum += v;
      share[frame] = sum / static_cast<double>(moving.data.size());
      const MutexLock lock(handing_over);
      on_frame(frame, moving);
    });
  }
  double sum = 0.0;
  for (const double s : share) sum += s;
  motion.moving_share = frames.count > 0 ? sum / frames.count : 0.0;
  return motion;
}

double LowestMovingRow(const Image& moving) {
  constexpr double kMinShare = 0.003;
  cv::Mat is_moving(moving.height, moving.width, CV_8U);
  std::transform(moving.data.begin(), moving.data.end(), is_moving.begin<uint8_t>(), [](float v) {
    return v > 0.5f ? uint8_t{1} : uint8_t{0};
  });
  cv::Mat labels, statistics, centers;
  const int count = cv::connectedComponentsWithStats(is_moving, labels, statistics, centers);
  int largest = 0, foot = -1;
  for (int i = 1; i < count; ++i) {  // 0 is the background
    const int area = statistics.at<int>(i, cv::CC_STAT_AREA);
    if (area <= largest) continue;
    largest = area;
    foot = statistics.at<int>(i, cv::CC_STAT_TOP) + statistics.at<int>(i, cv::CC_STAT_HEIGHT);
  }
  const double share = largest / static_cast<double>(moving.PlaneSize());
  return share < kMinShare ? -1.0 : foot / static_cast<double>(moving.height);
}

}  // namespace color3d
