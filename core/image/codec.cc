#include "core/image/codec.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/range_check.h"
#include "core/image/area_reducer.h"
#include "core/image/decode.h"
#include "core/image/decode/decoders.h"
#include "core/image/decode/srgb_conversion.h"
#include "core/image/decode_budget.h"
#include "core/image/probe/color_tag.h"
#include "core/image/probe/orientation.h"
#include "core/image/probe/tiff_pages.h"

namespace color3d {
namespace {

// OpenCV keeps colours as B, G, R (, A).
int PlaneOfChannel(int channel, int channels) {
  return channels >= 3 && channel < 3 ? 2 - channel : channel;
}

template <typename Sample>
Image PlanarFromMat(const cv::Mat& mat, float scale) {
  const int channels = mat.channels();
  Image image(mat.cols, mat.rows, channels);
  for (int y = 0; y < mat.rows; ++y) {
    const Sample* row = mat.ptr<Sample>(y);
    for (int c = 0; c < channels; ++c) {
      float* out = image.Plane(PlaneOfChannel(c, channels)) + static_cast<size_t>(y) * mat.cols;
      for (int x = 0; x < mat.cols; ++x) out[x] = scale * static_cast<float>(row[x * channels + c]);
    }
  }
  return image;
}

// The same with area averaging on the way: only the reduced picture is held as floats.
template <typename Sample>
Image ReducedFromMat(const cv::Mat& mat, float scale, const PictureSize& size) {
  const int channels = mat.channels();
  AreaReducer reducer(mat.cols, mat.rows, channels, size.width, size.height);
  for (int y = 0; y < mat.rows; ++y) reducer.AddRow(mat.ptr<Sample>(y));
  Image image = reducer.Take();
  for (float& v : image.data) v *= scale;
  if (channels >= 3) {
    std::swap_ranges(image.Plane(0), image.Plane(0) + image.PlaneSize(), image.Plane(2));
  }
  return image;
}

template <typename Sample>
Image FloatsFromMat(const cv::Mat& mat, float scale, const PictureSize& size) {
  if (size.width == mat.cols && size.height == mat.rows) {
    return PlanarFromMat<Sample>(mat, scale);
  }
  return ReducedFromMat<Sample>(mat, scale, size);
}

template <typename Sample>
cv::Mat MatFromPlanar(const Image& image, int type, float scale) {
  const int channels = image.channels;
  cv::Mat mat(image.height, image.width, CV_MAKETYPE(type, channels));
  for (int y = 0; y < image.height; ++y) {
    Sample* row = mat.ptr<Sample>(y);
    for (int c = 0; c < channels; ++c) {
      const float* in =
          image.Plane(PlaneOfChannel(c, channels)) + static_cast<size_t>(y) * image.width;
      for (int x = 0; x < image.width; ++x) {
        // The order of the comparison maps NaN to 0.
        const float v = in[x] > 0.0f ? std::min(in[x], 1.0f) : 0.0f;
        row[x * channels + c] = static_cast<Sample>(v * scale + 0.5f);
      }
    }
  }
  return mat;
}

// EXIF 2.3, tag 274: position of the stored row 0 and column 0 in the picture.
Image Oriented(Image stored, int orientation) {
  if (orientation == 1) return stored;
  const bool swap = OrientationSwapsSides(orientation);
  Image image(
      swap ? stored.height : stored.width, swap ? stored.width : stored.height, stored.channels);
  const bool flip_x = orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
  const bool flip_y = orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
  for (int c = 0; c < stored.channels; ++c) {
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        int sx = swap ? y : x;
        int sy = swap ? x : y;
        if (flip_x) sx = stored.width - 1 - sx;
        if (flip_y) sy = stored.height - 1 - sy;
        image.At(c, y, x) = stored.At(c, sy, sx);
      }
    }
  }
  return image;
}

// Keeps the colour planes (and alpha, if wanted) of the file: OpenCV expands grey with alpha to
// four channels.
Image SelectChannels(Image image, const ImageInfo& info, bool keep_alpha) {
  const bool gray = info.channels <= 2;
  const bool has_alpha = image.channels == 4;
  const int color_channels = gray ? 1 : std::min(image.channels, 3);
  const bool alpha = has_alpha && keep_alpha;
  if (image.channels == color_channels + (alpha ? 1 : 0)) return image;
  Image out(image.width, image.height, color_channels + (alpha ? 1 : 0));
  const size_t n = image.PlaneSize();
  std::copy_n(image.data.begin(), n * color_channels, out.data.begin());
  if (alpha) std::copy_n(image.Plane(3), n, out.Plane(color_channels));
  return out;
}

// Decodes with OpenCV, which chooses a decoder by the first bytes: only for formats that no other
// decoder of OpenCV (including GDAL's) accepts.
cv::Mat DecodeByOpenCv(std::string_view bytes, const std::string& file_name, int flags) {
  try {
    const cv::Mat input(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data()));
    return cv::imdecode(input, flags);
  } catch (const cv::Exception& e) {
    if (e.code == cv::Error::StsNoMem) throw std::bad_alloc();
    throw InvalidArgument("{} cannot be decoded ({}); save it again", file_name, e.err);
  }
}

// `reduction`: 1, or 2, 4, 8 for JPEG files, whose sides are divided by it (rounded up).
cv::Mat DecodeStored(std::string_view bytes,
                     const std::string& file_name,
                     const ImageInfo& info,
                     int reduction) {
  constexpr int kReduced = cv::IMREAD_IGNORE_ORIENTATION;
  const int flags = reduction == 2   ? kReduced | cv::IMREAD_REDUCED_COLOR_2
                    : reduction == 4 ? kReduced | cv::IMREAD_REDUCED_COLOR_4
                    : reduction == 8 ? kReduced | cv::IMREAD_REDUCED_COLOR_8
                                     : cv::IMREAD_UNCHANGED;
  cv::Mat mat;
  switch (info.format) {
    case ImageFormat::kJpeg:
    case ImageFormat::kPng:
      mat = DecodeByOpenCv(bytes, file_name, flags);
      break;
    case ImageFormat::kBmp:
      // OpenCV 4.6 reads the colours of some BMPs as grey by default.
      mat = DecodeByOpenCv(bytes, file_name, info.channels == 3 ? cv::IMREAD_COLOR : flags);
      break;
    case ImageFormat::kTiff:
      mat = DecodeByOpenCv(TiffPageAsStored(bytes, info.tiff_directory), file_name, flags);
      break;
    case ImageFormat::kWebp:
      mat = DecodeWebp(bytes, info);
      break;
    case ImageFormat::kHeif:
      mat = DecodeHeif(bytes, file_name, info);
      break;
  }
  if (mat.empty()) {
    throw InvalidArgument(
        "{} cannot be decoded: its image data is damaged or of an unsupported kind; save it again "
        "as JPEG or PNG",
        file_name);
  }
  const auto reduced = [reduction](int size) { return (size + reduction - 1) / reduction; };
  if (mat.cols != reduced(info.width) || mat.rows != reduced(info.height)) {
    throw InvalidArgument("{} is damaged: its header and its data differ in size", file_name);
  }
  return mat;
}

std::string Encode(const cv::Mat& mat, const char* extension, const std::vector<int>& parameters) {
  try {
    std::vector<uchar> bytes;
    if (cv::imencode(extension, mat, bytes, parameters)) {
      return std::string(bytes.begin(), bytes.end());
    }
  } catch (const cv::Exception& e) {
    if (e.code == cv::Error::StsNoMem) throw std::bad_alloc();
    throw Error(ErrorCode::kInternal, "encoding {} failed: {}", extension, e.err);
  }
  throw Error(ErrorCode::kInternal, "encoding {} failed", extension);
}

void CheckEncodable(const Image& image, bool alpha_allowed) {
  const int c = image.channels;
  if (image.Empty() || !(c == 1 || c == 3 || (alpha_allowed && c == 4))) {
    throw InvalidArgument(
        "cannot encode an image of {} x {} px and {} channels", image.width, image.height, c);
  }
}

// Images of at most this size as floats are reduced by Resize, larger ones before conversion to
// floats.
constexpr int64_t kMaxFloatBytes = int64_t{256} << 20;

// The size at which the stored picture is converted to floats: its own, or `size` if that saves
// much memory. Both as stored, before orientation.
PictureSize FloatSize(const cv::Mat& mat, const ImageInfo& info, const PictureSize& size) {
  if (FloatBytes(info, mat.cols, mat.rows) <= kMaxFloatBytes) return {mat.cols, mat.rows};
  return {std::clamp(size.width, 1, mat.cols), std::clamp(size.height, 1, mat.rows)};
}

PictureSize Turned(const PictureSize& size, bool swap) {
  return swap ? PictureSize{size.height, size.width} : size;
}

// Decoded size with sides divided by `reduction`.
ImageInfo ReducedInfo(ImageInfo info, int reduction) {
  info.width = (info.width + reduction - 1) / reduction;
  info.height = (info.height + reduction - 1) / reduction;
  return info;
}

// Peak memory of Decode if `wanted` (as stored) is the size of its result.
int64_t BytesOfDecoding(const ImageInfo& info, const PictureSize& wanted, bool copies) {
  const int64_t whole = DecodingBytes(info, copies);
  const int64_t floats = FloatBytes(info, info.width, info.height);
  if (floats <= kMaxFloatBytes || (wanted.width >= info.width && wanted.height >= info.height)) {
    return whole;
  }
  const PictureSize size{std::min(wanted.width, info.width), std::min(wanted.height, info.height)};
  return std::min(whole, whole - floats + 2 * FloatBytes(info, size.width, size.height));
}

}  // namespace

Image Decode(std::string_view bytes,
             const std::string& file_name,
             const ImageInfo& info,
             const DecodeRequest& request) {
  const ImageInfo decoded = ReducedInfo(info, request.jpeg_reduction);
  const int orientation = ReadOrientation(bytes);
  const bool swap = OrientationSwapsSides(orientation);
  const PictureSize own = Turned({decoded.width, decoded.height}, swap);
  const PictureSize wanted = request.wanted ? request.wanted(own) : own;
  const bool has_alpha = info.channels == 2 || info.channels == 4;
  const bool copies = orientation != 1 || (has_alpha && !request.keep_alpha);
  const PictureTurn turn(
      {file_name, info.width, info.height, BytesOfDecoding(decoded, Turned(wanted, swap), copies)});
  Image image;
  int bits = 8;
  {
    const cv::Mat mat = DecodeStored(bytes, file_name, info, request.jpeg_reduction);
    bits = mat.depth() == CV_8U ? 8 : 16;
    const PictureSize size = FloatSize(mat, info, Turned(wanted, swap));
    if (mat.depth() == CV_8U) {
      image = FloatsFromMat<uint8_t>(mat, 1.0f / 255.0f, size);
    } else if (mat.depth() == CV_16U) {
      image = FloatsFromMat<uint16_t>(mat, 1.0f / 65535.0f, size);
      // OpenCV inverts such pictures of 8 bits but not of 16 (film scans).
      if (info.min_is_white) {
        for (float& v : image.data) v = 1.0f - v;
      }
    } else {
      throw InvalidArgument("{} has neither 8 nor 16 bits per channel; save it as such", file_name);
    }
  }
  image = SelectChannels(std::move(image), info, request.keep_alpha);
  // PictureNotes reports tags that cannot be followed.
  if (!request.keep_stored_values) ConvertToSrgb(ReadColorTag(bytes), bits, &image);
  image = Oriented(std::move(image), orientation);
  if (image.width == wanted.width && image.height == wanted.height) return image;
  return Resize(image, wanted.width, wanted.height);
}

Image DecodeImage(std::string_view bytes, const std::string& file_name, bool keep_alpha) {
  return Decode(bytes, file_name, ProbeImage(bytes, file_name), {.keep_alpha = keep_alpha});
}

Image ReadImage(const std::filesystem::path& path, bool keep_alpha) {
  return DecodeImage(ReadFile(path), path.filename().string(), keep_alpha);
}

Image ReadStoredValues(const std::filesystem::path& path) {
  const std::string bytes = ReadFile(path);
  const std::string name = path.filename().string();
  return Decode(bytes, name, ProbeImage(bytes, name), {.keep_stored_values = true});
}

std::vector<std::string> PictureNotes(std::string_view bytes) {
  std::vector<std::string> notes;
  const std::string pages = DescribeTiffPages(ListTiffPages(bytes));
  if (!pages.empty()) notes.push_back(pages);
  const std::string problem = ColorTagProblem(ReadColorTag(bytes));
  if (!problem.empty()) notes.push_back("is read as sRGB: " + problem);
  return notes;
}

bool IsGray(const Image& srgb, float tolerance) {
  if (srgb.channels <= 2) return true;
  const size_t n = srgb.PlaneSize();
  const float* r = srgb.Plane(0);
  const float* g = srgb.Plane(1);
  const float* b = srgb.Plane(2);
  size_t colored = 0;
  for (size_t i = 0; i < n; ++i) {
    if (std::abs(r[i] - g[i]) > tolerance || std::abs(g[i] - b[i]) > tolerance) ++colored;
  }
  return static_cast<double>(colored) <= 0.005 * static_cast<double>(n);
}

namespace {

// Inserts the chunk after the header, the first chunk, which ends at byte 33.
std::string WithSrgbChunk(const std::string& png) {
  constexpr size_t kHeaderEnd = 33;
  // Length 1, type, relative to white as photographs are, checksum.
  const std::string chunk("\0\0\0\x01sRGB\0\xAE\xCE\x1C\xE9", 13);
  return std::string(png).insert(kHeaderEnd, chunk);
}

// Inserts the profile after the JFIF segment, which must be the first.
std::string WithProfile(const std::string& jpeg, const std::string& profile) {
  const size_t first =
      4 + static_cast<unsigned char>(jpeg[4]) * 256u + static_cast<unsigned char>(jpeg[5]);
  const std::string body = std::string("ICC_PROFILE\0\x01\x01", 14) + profile;
  std::string segment("\xFF\xE2", 2);
  segment += static_cast<char>((body.size() + 2) / 256);
  segment += static_cast<char>((body.size() + 2) % 256);
  return std::string(jpeg).insert(first, segment + body);
}

}  // namespace

std::string EncodePng8(const Image& image) {
  CheckEncodable(image, true);
  return WithSrgbChunk(Encode(MatFromPlanar<uint8_t>(image, CV_8U, 255.0f), ".png", {}));
}

std::string EncodePng16(const Image& image) {
  CheckEncodable(image, true);
  return WithSrgbChunk(Encode(MatFromPlanar<uint16_t>(image, CV_16U, 65535.0f), ".png", {}));
}

std::string EncodeJpeg(const Image& image, int quality) {
  CheckEncodable(image, false);
  RangeCheck("JPEG")("quality", quality, 1, 100);
  const cv::Mat mat = MatFromPlanar<uint8_t>(image, CV_8U, 255.0f);
  return WithProfile(Encode(mat, ".jpg", {cv::IMWRITE_JPEG_QUALITY, quality}),
                     image.channels == 1 ? SrgbGrayProfile() : SrgbProfile());
}

}  // namespace color3d
