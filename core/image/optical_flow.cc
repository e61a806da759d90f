#include "core/image/optical_flow.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/video/tracking.hpp>
#include <string>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kSmallestSide = 32;  // DIS works on 8 px patches of a pyramid

cv::Mat EightBit(const Image& luminance) {
  cv::Mat out(luminance.height, luminance.width, CV_8UC1);
  for (int y = 0; y < luminance.height; ++y) {
    uchar* row = out.ptr<uchar>(y);
    for (int x = 0; x < luminance.width; ++x) {
      row[x] = cv::saturate_cast<uchar>(2.55f * luminance.At(0, y, x));
    }
  }
  return out;
}

}  // namespace

Image DenseFlow(const Image& from, const Image& to) {
  if (from.channels != 1 || to.channels != 1 || from.width != to.width ||
      from.height != to.height) {
    throw InvalidArgument(
        "optical flow needs two pictures of one channel and one size, got {}x{} and {}x{}",
        from.width,
        from.height,
        to.width,
        to.height);
  }
  Image flow(from.width, from.height, 2);
  if (std::min(from.width, from.height) < kSmallestSide) return flow;
  try {
    const auto dis = cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_MEDIUM);
    cv::Mat field;
    dis->calc(EightBit(from), EightBit(to), field);
    for (int y = 0; y < from.height; ++y) {
      const cv::Point2f* row = field.ptr<cv::Point2f>(y);
      for (int x = 0; x < from.width; ++x) {
        flow.At(0, y, x) = row[x].x;
        flow.At(1, y, x) = row[x].y;
      }
    }
  } catch (const cv::Exception& error) {
    throw Error(ErrorCode::kInternal, std::string("optical flow failed: ") + error.what());
  }
  return flow;
}

}  // namespace color3d
