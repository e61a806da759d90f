#include "core/film/reappearing_regions.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "core/base/error.h"
#include "core/film/frame_motion.h"
#include "core/image/feature_matches.h"
#include "core/image/optical_flow.h"
#include "core/image/plane_sampling.h"

namespace color3d {
namespace {

constexpr int kFeatures = 3000;
constexpr double kMinContrast = 0.02;  // of features; low, so that weak texture counts
constexpr int kMaxPlanes = 3;
constexpr size_t kMinOfPlane = 12;  // features
constexpr double kOnPlanePx = 4.0;
constexpr int kTries = 2000;
constexpr double kSurely = 0.999;
constexpr double kMaxScale = 5.0;  // change of lengths

LocalFeatures DetectFeatures(const Image& luminance) {
  Image gray = luminance;
  for (float& value : gray.data) value *= 0.01f;
  return DetectLocalFeatures(gray, kFeatures, kMinContrast);
}

struct Matches {
  std::vector<cv::Point2f> in_key, in_frame;
};

Matches MatchFeatures(const LocalFeatures& key, const LocalFeatures& frame, const Image& picture) {
  const auto place = [&](const LocalFeatures& features, int i) {
    return cv::Point2f(features.positions[2 * i] + 0.5f * picture.width - 0.5f,
                       features.positions[2 * i + 1] + 0.5f * picture.height - 0.5f);
  };
  Matches matches;
  for (const auto& [in_key, in_frame] : MutualMatches(key, frame)) {
    matches.in_key.push_back(place(key, in_key));
    matches.in_frame.push_back(place(frame, in_frame));
  }
  return matches;
}

bool IsPlausible(const cv::Matx33d& h) {
  const double area = h(0, 0) * h(1, 1) - h(0, 1) * h(1, 0);
  return area > 1.0 / (kMaxScale * kMaxScale) && area < kMaxScale * kMaxScale;
}

// Homographies from the frame to the key frame. Each is fitted to the matches that those before it
// do not explain.
std::vector<cv::Matx33d> FitPlanes(Matches matches) {
  std::vector<cv::Matx33d> planes;
  for (int i = 0; i < kMaxPlanes && matches.in_key.size() >= kMinOfPlane; ++i) {
    cv::Mat is_inlier;
    const cv::Mat found = cv::findHomography(
        matches.in_frame, matches.in_key, cv::USAC_MAGSAC, kOnPlanePx, is_inlier, kTries, kSurely);
    if (found.rows != 3) break;
    Matches rest;
    size_t inliers = 0;
    for (size_t k = 0; k < matches.in_key.size(); ++k) {
      if (is_inlier.at<uchar>(static_cast<int>(k)) != 0) {
        ++inliers;
        continue;
      }
      rest.in_key.push_back(matches.in_key[k]);
      rest.in_frame.push_back(matches.in_frame[k]);
    }
    if (inliers < kMinOfPlane) break;
    if (IsPlausible(found)) planes.emplace_back(found);
    matches = std::move(rest);
  }
  return planes;
}

Image PlaceOnPlane(const cv::Matx33d& h, const Image& picture) {
  Image place(picture.width, picture.height, 2);
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const cv::Vec3d p = h * cv::Vec3d(x, y, 1.0);
      const double w = p[2] > 1e-6 ? p[2] : 1e-6;
      // Places far outside need no exact value.
      place.At(0, y, x) = static_cast<float>(std::clamp(p[0] / w, -1e4, 1e4));
      place.At(1, y, x) = static_cast<float>(std::clamp(p[1] / w, -1e4, 1e4));
    }
  }
  return place;
}

// Places of the pixels of `picture` in `other`: by the homography, refined by flow.
Image Refined(const cv::Matx33d& h, const Image& picture, const Image& other) {
  const Image place = PlaceOnPlane(h, picture);
  return SampledAt(place, MovedPositions(DenseFlow(picture, SampledAt(other, place))));
}

}  // namespace

ReappearingRegions::ReappearingRegions(const Image& key)
    : key_(key), features_(DetectFeatures(key)) {}

std::vector<FilmTrack> ReappearingRegions::TracksTo(const Image& frame,
                                                    const CancellationToken& cancel) const {
  std::vector<FilmTrack> tracks;
  try {
    for (const cv::Matx33d& h : FitPlanes(MatchFeatures(features_, DetectFeatures(frame), key_))) {
      cancel.ThrowIfCancelled();
      tracks.push_back({Refined(h, frame, key_), Refined(h.inv(), key_, frame)});
    }
  } catch (const cv::Exception& e) {
    throw Error(ErrorCode::kInternal, "matching the features of two frames failed: {}", e.err);
  }
  return tracks;
}

}  // namespace color3d
