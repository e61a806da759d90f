#include "core/image/draw.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
// OpenCV's font has capitals of 21 px at scale 1.
constexpr double kCapitalPx = 21.0;
constexpr int kMarginPx = 3;

void RequireColor(const Image& canvas) {
  if (canvas.channels == 3 && !canvas.Empty()) return;
  throw InvalidArgument("drawing needs a picture of 3 channels, this one has {}", canvas.channels);
}

// UTF-8 sequences become one '?' each.
std::string Ascii(const std::string& text) {
  std::string ascii;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0u) == 0x80u) continue;
    ascii += byte >= 0x20 && byte < 0x7f ? c : '?';
  }
  return ascii;
}

int Thickness(int height_px) { return std::max(1, (height_px + 6) / 12); }

template <typename Blend>
void ForEachPixel(int x, int y, int width, int height, Image* canvas, const Blend& blend) {
  for (int row = std::max(0, -y); row < height && y + row < canvas->height; ++row) {
    for (int column = std::max(0, -x); column < width && x + column < canvas->width; ++column) {
      for (int c = 0; c < 3; ++c) {
        float& pixel = canvas->At(c, y + row, x + column);
        pixel = blend(c, row, column, pixel);
      }
    }
  }
}

}  // namespace

void DrawBox(int x, int y, int width, int height, const DrawColor& color, Image* canvas) {
  RequireColor(*canvas);
  ForEachPixel(x, y, width, height, canvas, [&](int c, int, int, float) { return color[c]; });
}

void DrawPicture(const Image& picture, int x, int y, float strength, Image* canvas) {
  RequireColor(*canvas);
  if (picture.channels != 1 && picture.channels != 3) {
    throw InvalidArgument("a picture of {} channels cannot be drawn", picture.channels);
  }
  ForEachPixel(
      x, y, picture.width, picture.height, canvas, [&](int c, int row, int column, float p) {
        const float value = picture.At(picture.channels == 3 ? c : 0, row, column);
        return p + strength * (value - p);
      });
}

void DrawText(
    const std::string& text, int x, int y, int height_px, const DrawColor& color, Image* canvas) {
  RequireColor(*canvas);
  const std::string ascii = Ascii(text);
  if (ascii.empty() || height_px < 1) return;
  // Space for descenders and the width of the pen.
  const int below = height_px / 2 + kMarginPx;
  cv::Mat mask(height_px + below + kMarginPx,
               TextWidth(ascii, height_px) + 2 * kMarginPx,
               CV_8U,
               cv::Scalar(0));
  cv::putText(mask,
              ascii,
              {kMarginPx, kMarginPx + height_px},
              kFont,
              height_px / kCapitalPx,
              cv::Scalar(255),
              Thickness(height_px),
              cv::LINE_AA);
  ForEachPixel(x - kMarginPx,
               y - kMarginPx,
               mask.cols,
               mask.rows,
               canvas,
               [&](int c, int row, int column, float p) {
                 const float ink = static_cast<float>(mask.at<uint8_t>(row, column)) / 255.0f;
                 return p + ink * (color[c] - p);
               });
}

int TextWidth(const std::string& text, int height_px) {
  int baseline = 0;
  return cv::getTextSize(
             Ascii(text), kFont, height_px / kCapitalPx, Thickness(height_px), &baseline)
      .width;
}

std::string FittingText(const std::string& text, int height_px, int width_px) {
  const std::string ascii = Ascii(text);
  if (TextWidth(ascii, height_px) <= width_px) return ascii;
  for (size_t kept = ascii.size() - 1; kept > 1; --kept) {
    const size_t head = kept / 2;
    const std::string shorter =
        ascii.substr(0, head) + "..." + ascii.substr(ascii.size() - kept + head);
    if (TextWidth(shorter, height_px) <= width_px) return shorter;
  }
  return "";
}

}  // namespace color3d
