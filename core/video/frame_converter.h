// Conversion of decoded frames to pictures by FFmpeg's libswscale. For this folder only.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/image.h"
#include "core/video/libav.h"

struct SwsContext;

namespace color3d {

// Returns true if frames of that format can be converted.
bool CanConvert(AVPixelFormat format);
// Returns true for grey formats, with or without alpha, integer or floating point.
bool IsGray(AVPixelFormat format);

// Not thread-safe.
class FrameConverter {
 public:
  // Returns R'G'B' in 0..1 of `width` x `height` px, in the frame's encoding; for an interlaced
  // frame the field that comes first. Uses the matrix that the frame states, and its `range`.
  // Without a stated range, grey and RGB are full range and Y'CbCr is limited range, except for
  // JPEG formats (yuvj), as in FFmpeg's programs. Throws Error{kDataLoss} if the frame cannot be
  // converted.
  Image Convert(const AVFrame& frame, AVColorRange range, int width, int height);

 private:
  struct FreeConverter {
    void operator()(SwsContext* converter) const;
  };
  // Parameters of converter_.
  struct Shape {
    int width = 0, lines = 0, format = AV_PIX_FMT_NONE;
    int out_width = 0, out_height = 0;
    bool operator==(const Shape&) const = default;
  };

  void Prepare(const Shape& shape);

  std::unique_ptr<SwsContext, FreeConverter> converter_;
  Shape shape_;
  bool is_full_ = false;  // range of frames that state none
  std::vector<uint16_t> rgb_;
};

}  // namespace color3d
