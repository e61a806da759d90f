// Decoded frames as pictures, by FFmpeg's own conversion. For this folder only.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/image.h"
#include "core/video/libav.h"

struct SwsContext;

namespace color3d {

// Whether frames of that format can be converted.
bool CanConvert(AVPixelFormat format);
// Grey, perhaps with transparency, in whole numbers or floating point.
bool IsGray(AVPixelFormat format);

// Not thread-safe.
class FrameConverter {
 public:
  // R'G'B' in 0..1 of `width` x `height` px, as the frame codes it; of an interlaced frame the
  // lines that come first. The matrix is the one that the frame states; `range` of values: as
  // stated, too. Where none is, greys are of full range, as RGB is, and Y'CbCr is of limited range,
  // but for the formats of JPEG (yuvj): so do FFmpeg's programs. Throws Error{kDataLoss} where it
  // cannot be converted.
  Image Convert(const AVFrame& frame, AVColorRange range, int width, int height);

 private:
  struct FreeConverter {
    void operator()(SwsContext* converter) const;
  };
  // What converter_ was made for.
  struct Shape {
    int width = 0, lines = 0, format = AV_PIX_FMT_NONE;
    int out_width = 0, out_height = 0;
    bool operator==(const Shape&) const = default;
  };

  void Prepare(const Shape& shape);

  std::unique_ptr<SwsContext, FreeConverter> converter_;
  Shape shape_;
  bool is_full_ = false;  // the range where a frame of that format states none
  std::vector<uint16_t> rgb_;
};

}  // namespace color3d
