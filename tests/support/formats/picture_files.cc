#include "tests/support/formats/picture_files.h"

#include <lcms2.h>
#include <webp/encode.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>
#ifdef COLOR3D_HEIF
#include <libheif/heif.h>
#endif

namespace color3d {
namespace {

void Put(std::string* bytes, uint64_t value, int count, bool big_endian) {
  for (int i = 0; i < count; ++i) {
    const int shift = 8 * (big_endian ? count - 1 - i : i);
    *bytes += static_cast<char>(value >> shift & 255u);
  }
}

uint32_t Stored(float value, int bits) {
  const float top = static_cast<float>((1u << bits) - 1);
  return static_cast<uint32_t>(std::clamp(value, 0.0f, 1.0f) * top + 0.5f);
}

// R, G, B, R, ... or grey, 8 bits.
std::string Interleaved8(const Image& image, int channels) {
  std::string bytes;
  for (size_t i = 0; i < image.PlaneSize(); ++i) {
    for (int c = 0; c < channels; ++c) {
      bytes += static_cast<char>(Stored(image.Plane(std::min(c, image.channels - 1))[i], 8));
    }
  }
  return bytes;
}

class TiffWriter {
 public:
  explicit TiffWriter(bool big_endian) : big_(big_endian), file_(big_endian ? "MM" : "II") {
    Put(&file_, 42, 2, big_);
    Put(&file_, 0, 4, big_);
  }

  // Offsets of the directory, and of its link to the next directory.
  std::pair<uint32_t, size_t> Write(const TiffPageToWrite& page) {
    std::vector<uint32_t> below;
    for (const TiffPageToWrite& sub : page.sub_directories) below.push_back(Write(sub).first);
    const Image& image = page.image;
    const uint32_t data = Here();
    for (size_t i = 0; i < image.PlaneSize(); ++i) {
      for (int c = 0; c < image.channels; ++c) {
        Put(&file_, Stored(image.Plane(c)[i], page.bits), page.bits / 8, big_);
      }
    }
    const uint32_t data_bytes = static_cast<uint32_t>(file_.size()) - data;
    const uint32_t profile = Here();
    file_ += page.profile;
    const uint32_t bits = Here();
    for (int c = 0; c < image.channels; ++c) Put(&file_, page.bits, 2, big_);
    const uint32_t places = Here();
    for (const uint32_t place : below) Put(&file_, place, 4, big_);
    const uint32_t directory = Here();
    const auto channels = static_cast<uint32_t>(image.channels);
    std::vector<std::array<uint32_t, 4>> tags = {
        // number, type, count, value
        {254, 4, 1, page.subfile_type},
        {256, 4, 1, static_cast<uint32_t>(image.width)},
        {257, 4, 1, static_cast<uint32_t>(image.height)},
        {258, 3, channels, channels == 1 ? static_cast<uint32_t>(page.bits) : bits},
        {259, 3, 1, 1},
        {262, 3, 1, page.photometric},
        {273, 4, 1, data},
        {274, 3, 1, page.orientation},
        {277, 3, 1, channels},
        {278, 4, 1, static_cast<uint32_t>(image.height)},
        {279, 4, 1, data_bytes}};
    if (!below.empty()) {
      const auto count = static_cast<uint32_t>(below.size());
      tags.push_back({330, 4, count, count == 1 ? below[0] : places});
    }
    if (!page.profile.empty()) {
      tags.push_back({34675, 7, static_cast<uint32_t>(page.profile.size()), profile});
    }
    Put(&file_, tags.size(), 2, big_);
    for (const auto& [number, type, count, value] : tags) {
      Put(&file_, number, 2, big_), Put(&file_, type, 2, big_), Put(&file_, count, 4, big_);
      const int bytes = type == 3 && count == 1 ? 2 : 4;
      Put(&file_, value, bytes, big_);
      Put(&file_, 0, 4 - bytes, big_);
    }
    Put(&file_, 0, 4, big_);
    return {directory, file_.size() - 4};
  }

  void PutPlace(size_t at, uint32_t place) {
    std::string bytes;
    Put(&bytes, place, 4, big_);
    file_.replace(at, 4, bytes);
  }
  std::string Take() { return std::move(file_); }

 private:
  uint32_t Here() {
    if (file_.size() % 2 == 1) file_ += '\0';
    return static_cast<uint32_t>(file_.size());
  }

  const bool big_;
  std::string file_;
};

struct CloseProfile {
  void operator()(void* profile) const { cmsCloseProfile(profile); }
};
using Profile = std::unique_ptr<void, CloseProfile>;

std::string Saved(const Profile& profile) {
  cmsUInt32Number size = 0;
  cmsSaveProfileToMem(profile.get(), nullptr, &size);
  std::string bytes(size, '\0');
  cmsSaveProfileToMem(profile.get(), bytes.data(), &size);
  return bytes;
}

std::string RgbProfile(double gamma,
                       const cmsCIExyY& white,
                       const cmsCIExyYTRIPLE& primaries,
                       bool srgb_curve = false) {
  const double parameters[] = {2.4, 1.0 / 1.055, 0.055 / 1.055, 1.0 / 12.92, 0.04045};
  cmsToneCurve* curve = srgb_curve ? cmsBuildParametricToneCurve(nullptr, 4, parameters)
                                   : cmsBuildGamma(nullptr, gamma);
  cmsToneCurve* const curves[] = {curve, curve, curve};
  const Profile profile(cmsCreateRGBProfile(&white, &primaries, curves));
  cmsFreeToneCurve(curve);
  return Saved(profile);
}

std::string GrayProfile(cmsToneCurve* curve) {
  const Profile profile(cmsCreateGrayProfile(cmsD50_xyY(), curve));
  cmsFreeToneCurve(curve);
  return Saved(profile);
}

}  // namespace

std::string TiffFile(const std::vector<TiffPageToWrite>& pages, bool big_endian) {
  TiffWriter writer(big_endian);
  size_t place_at = 4;
  for (const TiffPageToWrite& page : pages) {
    const auto [directory, next_at] = writer.Write(page);
    writer.PutPlace(place_at, directory);
    place_at = next_at;
  }
  return writer.Take();
}

std::string BmpFile(const Image& srgb, const std::string& profile) {
  const uint32_t header_bytes = profile.empty() ? 40 : 124;
  std::string rows;
  for (int y = srgb.height - 1; y >= 0; --y) {
    for (int x = 0; x < srgb.width; ++x) {
      for (int c = 2; c >= 0; --c) {
        rows += static_cast<char>(Stored(srgb.At(std::min(c, srgb.channels - 1), y, x), 8));
      }
    }
    while (rows.size() % 4 != 0) rows += '\0';
  }
  const uint32_t data = 14 + header_bytes;
  std::string file = "BM";
  Put(&file, data + rows.size() + profile.size(), 4, false);
  Put(&file, 0, 4, false), Put(&file, data, 4, false);
  std::string header;
  Put(&header, header_bytes, 4, false);
  Put(&header, srgb.width, 4, false), Put(&header, srgb.height, 4, false);
  Put(&header, 1, 2, false), Put(&header, 24, 2, false);
  Put(&header, 0, 4, false), Put(&header, rows.size(), 4, false);
  header.resize(header_bytes, '\0');
  if (!profile.empty()) {
    std::string place;
    Put(&place, header_bytes + rows.size(), 4, false), Put(&place, profile.size(), 4, false);
    header.replace(56, 4, "DEBM");
    header.replace(112, 8, place);
  }
  return file + header + rows + profile;
}

std::string WebpFile(const Image& srgb, const std::string& profile) {
  const std::string rgb = Interleaved8(srgb, 3);
  uint8_t* encoded = nullptr;
  const size_t size = WebPEncodeLosslessRGB(reinterpret_cast<const uint8_t*>(rgb.data()),
                                            srgb.width,
                                            srgb.height,
                                            3 * srgb.width,
                                            &encoded);
  std::string plain(reinterpret_cast<char*>(encoded), size);
  WebPFree(encoded);
  if (profile.empty()) return plain;
  std::string body = "WEBPVP8X";
  Put(&body, 10, 4, false);
  Put(&body, 0x20, 4, false);  // has a profile
  Put(&body, srgb.width - 1, 3, false), Put(&body, srgb.height - 1, 3, false);
  body += "ICCP";
  Put(&body, profile.size(), 4, false);
  body += profile;
  if (profile.size() % 2 == 1) body += '\0';
  body += plain.substr(12);
  std::string file = "RIFF";
  Put(&file, body.size(), 4, false);
  return file + body;
}

#ifdef COLOR3D_HEIF
std::string HeicFile(const Image& srgb, const std::string& profile, int bits) {
  heif_context* context = heif_context_alloc();
  heif_encoder* encoder = nullptr;
  std::string file;
  heif_image* image = nullptr;
  const heif_error found =
      heif_context_get_encoder_for_format(context, heif_compression_HEVC, &encoder);
  if (found.code == heif_error_Ok) {
    heif_encoder_set_lossless(encoder, 0);
    heif_encoder_set_lossy_quality(encoder, 95);
    heif_encoder_set_parameter(encoder, "chroma", "444");
    const bool deep = bits > 8;
    heif_image_create(srgb.width,
                      srgb.height,
                      heif_colorspace_RGB,
                      deep ? heif_chroma_interleaved_RRGGBB_LE : heif_chroma_interleaved_RGB,
                      &image);
    heif_image_add_plane(image, heif_channel_interleaved, srgb.width, srgb.height, bits);
    int stride = 0;
    uint8_t* plane = heif_image_get_plane(image, heif_channel_interleaved, &stride);
    for (int y = 0; y < srgb.height; ++y) {
      std::string row;
      for (int i = 0; i < 3 * srgb.width; ++i) {
        const float value = srgb.At(std::min(i % 3, srgb.channels - 1), y, i / 3);
        Put(&row, Stored(value, bits), deep ? 2 : 1, false);
      }
      std::copy(row.begin(), row.end(), plane + static_cast<size_t>(y) * stride);
    }
    if (!profile.empty()) {
      heif_image_set_raw_color_profile(image, "prof", profile.data(), profile.size());
    }
    heif_context_encode_image(context, image, encoder, nullptr, nullptr);
    heif_writer writer{};
    writer.writer_api_version = 1;
    writer.write = [](heif_context*, const void* data, size_t size, void* to) {
      static_cast<std::string*>(to)->append(static_cast<const char*>(data), size);
      return heif_error{heif_error_Ok, heif_suberror_Unspecified, "ok"};
    };
    heif_context_write(context, &writer, &file);
    heif_image_release(image);
    heif_encoder_release(encoder);
  }
  heif_context_free(context);
  return file;
}
#else
std::string HeicFile(const Image&, const std::string&, int) { return ""; }
#endif

std::string WithPngChunk(const std::string& png, const std::string& type, const std::string& body) {
  const std::string content = type + body;
  std::string chunk;
  Put(&chunk, body.size(), 4, true);
  chunk += content;
  Put(&chunk,
      ::crc32_z(0, reinterpret_cast<const Bytef*>(content.data()), content.size()),
      4,
      true);
  return std::string(png).insert(33, chunk);
}

std::string WithJpegSegment(const std::string& jpeg, int marker, const std::string& body) {
  std::string segment = "\xFF";
  segment += static_cast<char>(marker);
  Put(&segment, body.size() + 2, 2, true);
  return std::string(jpeg).insert(2, segment + body);
}

std::string WithPngProfile(const std::string& png, const std::string& profile) {
  std::string packed(::compressBound(profile.size()), '\0');
  uLongf size = packed.size();
  ::compress(reinterpret_cast<Bytef*>(packed.data()),
             &size,
             reinterpret_cast<const Bytef*>(profile.data()),
             profile.size());
  return WithPngChunk(png, "iCCP", std::string("p\0\0", 3) + packed.substr(0, size));
}

std::string WithJpegProfile(const std::string& jpeg,
                            const std::string& profile,
                            size_t part_bytes) {
  const size_t count = (profile.size() + part_bytes - 1) / part_bytes;
  std::string file = jpeg;
  for (size_t i = count; i > 0; --i) {  // each is inserted at the front
    std::string body("ICC_PROFILE\0", 12);
    body += static_cast<char>(i);
    body += static_cast<char>(count);
    file = WithJpegSegment(file, 0xE2, body + profile.substr((i - 1) * part_bytes, part_bytes));
  }
  return file;
}

std::string AdobeRgbProfile() {
  return RgbProfile(563.0 / 256.0,
                    {0.3127, 0.3290, 1.0},
                    {{0.64, 0.33, 1.0}, {0.21, 0.71, 1.0}, {0.15, 0.06, 1.0}});
}

std::string ProPhotoProfile() {
  return RgbProfile(
      1.8, *cmsD50_xyY(), {{0.7347, 0.2653, 1.0}, {0.1596, 0.8404, 1.0}, {0.0366, 0.0001, 1.0}});
}

std::string DisplayP3Profile() {
  return RgbProfile(0.0,
                    {0.3127, 0.3290, 1.0},
                    {{0.680, 0.320, 1.0}, {0.265, 0.690, 1.0}, {0.150, 0.060, 1.0}},
                    /*srgb_curve=*/true);
}

std::string GrayGammaProfile(double gamma) { return GrayProfile(cmsBuildGamma(nullptr, gamma)); }

std::string DotGainProfile(double percent) {
  // Dot gain: printed dots cover more than their nominal area. The gain is a parabola.
  std::vector<float> table(256);
  for (size_t i = 0; i < table.size(); ++i) {
    const double ink = 1.0 - static_cast<double>(i) / 255.0;
    table[i] = static_cast<float>(1.0 - (ink + 4.0 * percent / 100.0 * ink * (1.0 - ink)));
  }
  return GrayProfile(cmsBuildTabulatedToneCurveFloat(
      nullptr, static_cast<cmsUInt32Number>(table.size()), table.data()));
}

std::string CmykProfile() {
  return Saved(Profile(cmsCreateInkLimitingDeviceLink(cmsSigCmykData, 300.0)));
}

Image ConvertToProfile(const Image& srgb, const std::string& bytes) {
  const Profile space(
      cmsOpenProfileFromMem(bytes.data(), static_cast<cmsUInt32Number>(bytes.size())));
  const bool gray = cmsGetColorSpace(space.get()) == cmsSigGrayData;
  const double parameters[] = {2.4, 1.0 / 1.055, 0.055 / 1.055, 1.0 / 12.92, 0.04045};
  cmsToneCurve* curve = cmsBuildParametricToneCurve(nullptr, 4, parameters);
  const Profile from(gray ? cmsCreateGrayProfile(cmsD50_xyY(), curve) : cmsCreate_sRGBProfile());
  cmsFreeToneCurve(curve);
  const cmsUInt32Number format = gray ? TYPE_GRAY_FLT : TYPE_RGB_FLT;
  cmsHTRANSFORM transform = cmsCreateTransform(
      from.get(), format, space.get(), format, INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOOPTIMIZE);
  Image out = srgb;
  const size_t channels = gray ? 1 : 3;
  std::vector<float> pixel(channels);
  for (size_t i = 0; i < srgb.PlaneSize(); ++i) {
    for (size_t c = 0; c < channels; ++c) pixel[c] = srgb.Plane(static_cast<int>(c))[i];
    cmsDoTransform(transform, pixel.data(), pixel.data(), 1);
    for (size_t c = 0; c < channels; ++c) out.Plane(static_cast<int>(c))[i] = pixel[c];
  }
  cmsDeleteTransform(transform);
  return out;
}

}  // namespace color3d
