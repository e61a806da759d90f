#include "core/image/decode/srgb_conversion.h"

#include <lcms2.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "core/base/error.h"

namespace color3d {
namespace {

// Rounding to 8 bits and half a step.
constexpr float kSame = 1.5f / 255.0f;
constexpr int kIntent = INTENT_RELATIVE_COLORIMETRIC;
constexpr cmsUInt32Number kKeepBlack = cmsFLAGS_BLACKPOINTCOMPENSATION;
constexpr cmsUInt32Number kExact = kKeepBlack | cmsFLAGS_NOOPTIMIZE;

struct Close {
  void operator()(void* profile) const { cmsCloseProfile(profile); }
};
struct Delete {
  void operator()(void* transform) const { cmsDeleteTransform(transform); }
};
struct Free {
  void operator()(cmsToneCurve* curve) const { cmsFreeToneCurve(curve); }
};
using Profile = std::unique_ptr<void, Close>;
using Transform = std::unique_ptr<void, Delete>;
using Curve = std::unique_ptr<cmsToneCurve, Free>;

Curve SrgbCurve() {
  const double parameters[] = {2.4, 1.0 / 1.055, 0.055 / 1.055, 1.0 / 12.92, 0.04045};
  return Curve(cmsBuildParametricToneCurve(nullptr, 4, parameters));
}

Profile SrgbGray() { return Profile(cmsCreateGrayProfile(cmsD50_xyY(), SrgbCurve().get())); }

bool IsGray(const ColorTag& tag) {
  return !tag.profile.empty() && std::string_view(tag.profile).substr(16, 4) == "GRAY";
}

// Profile of the chromaticities and the gamma in a file.
Profile ProfileOfNumbers(const ColorTag& tag) {
  const Chromaticities c =
      tag.primaries.value_or(Chromaticities{0.3127, 0.3290, 0.64, 0.33, 0.30, 0.60, 0.15, 0.06});
  const cmsCIExyY white{c.white_x, c.white_y, 1.0};
  const cmsCIExyYTRIPLE primaries{
      {c.red_x, c.red_y, 1.0}, {c.green_x, c.green_y, 1.0}, {c.blue_x, c.blue_y, 1.0}};
  const Curve curve(cmsBuildGamma(nullptr, tag.gamma));
  cmsToneCurve* const curves[] = {curve.get(), curve.get(), curve.get()};
  return Profile(cmsCreateRGBProfile(&white, &primaries, curves));
}

// Returns null if there is nothing to convert or, with `problem` set, if the tag cannot be used.
Profile OpenProfile(const ColorTag& tag, std::string* problem) {
  *problem = tag.problem;
  if (!problem->empty()) return nullptr;
  if (tag.profile.empty()) {
    if (tag.gamma == 0.0) return nullptr;
    Profile profile = ProfileOfNumbers(tag);
    if (!profile) *problem = "its primaries are invalid";
    return profile;
  }
  Profile profile(
      cmsOpenProfileFromMem(tag.profile.data(), static_cast<cmsUInt32Number>(tag.profile.size())));
  if (!profile) {
    *problem = "its colour profile is damaged";
    return nullptr;
  }
  // Read from the bytes, because Little CMS returns an enum that cannot hold a damaged value.
  const std::string_view bytes = tag.profile;
  const std::string_view kind = bytes.substr(12, 4), space = bytes.substr(16, 4);
  const bool is_device = kind == "scnr" || kind == "mntr" || kind == "prtr" || kind == "spac";
  if (!is_device || (space != "RGB " && space != "GRAY")) {
    *problem = "its colour profile is not one of RGB or grey";
    return nullptr;
  }
  return profile;
}

float Clamped(float v) { return v > 0.0f ? std::min(v, 1.0f) : 0.0f; }  // NaN: 0

// Converted values of the greys i / (count - 1); empty if the profile cannot be used.
std::vector<float> ToneTable(const Profile& profile, bool gray, size_t count) {
  const Profile target(gray ? SrgbGray() : Profile(cmsCreate_sRGBProfile()));
  const cmsUInt32Number format = gray ? TYPE_GRAY_FLT : TYPE_RGB_FLT;
  const Transform transform(
      cmsCreateTransform(profile.get(), format, target.get(), format, kIntent, kExact));
  if (!transform) return {};
  const size_t channels = gray ? 1 : 3;
  std::vector<float> in(count * channels), out(count * channels), table(count);
  for (size_t i = 0; i < in.size(); ++i) {
    in[i] = static_cast<float>(i / channels) / static_cast<float>(count - 1);
  }
  cmsDoTransform(transform.get(), in.data(), out.data(), static_cast<cmsUInt32Number>(count));
  for (size_t i = 0; i < count; ++i) table[i] = Clamped(out[i * channels + channels / 2]);
  return table;
}

bool IsIdentity(const std::vector<float>& table) {
  for (size_t i = 0; i < table.size(); ++i) {
    const float value = static_cast<float>(i) / static_cast<float>(table.size() - 1);
    if (std::abs(table[i] - value) > kSame) return false;
  }
  return true;
}

// Colours on a grid, R, G, B, R, ...
std::vector<float> GridColors() {
  constexpr int kSteps = 7;
  std::vector<float> colors;
  for (int i = 0; i < kSteps * kSteps * kSteps; ++i) {
    for (const int step : {i % kSteps, i / kSteps % kSteps, i / kSteps / kSteps}) {
      colors.push_back(static_cast<float>(step) / (kSteps - 1));
    }
  }
  return colors;
}

std::vector<float> Transformed(const Transform& transform, const std::vector<float>& colors) {
  std::vector<float> out(colors.size());
  cmsDoTransform(
      transform.get(), colors.data(), out.data(), static_cast<cmsUInt32Number>(colors.size() / 3));
  return out;
}

bool AreNear(const std::vector<float>& x, const std::vector<float>& y, float difference) {
  return std::equal(x.begin(), x.end(), y.begin(), [&](float a, float b) {
    return std::abs(Clamped(a) - Clamped(b)) <= difference;
  });
}

// Three curves and a matrix, the kind of most profiles, evaluated with tables: as exact as Little
// CMS's floats, and nine times as fast.
class MatrixShaper {
 public:
  // Returns null for other profiles, and for those that the tables do not reproduce to 1e-4.
  static std::unique_ptr<MatrixShaper> Of(const Profile& profile, const Transform& exact) {
    if (!cmsIsMatrixShaper(profile.get())) return nullptr;
    std::unique_ptr<MatrixShaper> shaper(new MatrixShaper());
    if (!shaper->ReadCurves(profile) || !shaper->ReadMatrix(profile)) return nullptr;
    std::vector<float> colors = GridColors();
    const std::vector<float> expected = Transformed(exact, colors);
    for (size_t i = 0; i < colors.size(); i += 3) {
      shaper->Convert(&colors[i], &colors[i + 1], &colors[i + 2]);
    }
    return AreNear(colors, expected, 1e-4f) ? std::move(shaper) : nullptr;
  }

  // All in 0..1.
  void Convert(float* r, float* g, float* b) const {
    float* const channels[] = {r, g, b};
    float light[3];
    for (int c = 0; c < 3; ++c) {
      light[c] = light_[c][static_cast<size_t>(Clamped(*channels[c]) * kTop + 0.5f)];
    }
    for (int c = 0; c < 3; ++c) {
      const float at = kTop * Clamped(matrix_[c][0] * light[0] + matrix_[c][1] * light[1] +
                                      matrix_[c][2] * light[2]);
      const auto below = static_cast<size_t>(at);
      const float share = at - static_cast<float>(below);
      *channels[c] = value_[below] + share * (value_[below + 1] - value_[below]);
    }
  }

 private:
  static constexpr float kTop = 65535.0f;

  MatrixShaper() = default;

  bool ReadCurves(const Profile& profile) {
    constexpr cmsTagSignature kTags[] = {cmsSigRedTRCTag, cmsSigGreenTRCTag, cmsSigBlueTRCTag};
    for (int c = 0; c < 3; ++c) {
      const auto* curve = static_cast<const cmsToneCurve*>(cmsReadTag(profile.get(), kTags[c]));
      if (curve == nullptr || cmsEvalToneCurveFloat(curve, 1.0f) <= 0.0f) return false;
      for (int i = 0; i <= static_cast<int>(kTop); ++i) {
        light_[c].push_back(cmsEvalToneCurveFloat(curve, static_cast<float>(i) / kTop));
      }
    }
    const Curve encoding(cmsReverseToneCurve(SrgbCurve().get()));
    if (!encoding) return false;
    for (int i = 0; i <= static_cast<int>(kTop); ++i) {
      value_.push_back(
          Clamped(cmsEvalToneCurveFloat(encoding.get(), static_cast<float>(i) / kTop)));
    }
    value_.push_back(value_.back());
    return true;
  }

  // The light of each channel alone in that of sRGB's channels.
  bool ReadMatrix(const Profile& profile) {
    const Curve linear(cmsBuildGamma(nullptr, 1.0));
    cmsToneCurve* const curves[] = {linear.get(), linear.get(), linear.get()};
    const cmsCIExyY white{0.3127, 0.3290, 1.0};
    const cmsCIExyYTRIPLE primaries{{0.64, 0.33, 1.0}, {0.30, 0.60, 1.0}, {0.15, 0.06, 1.0}};
    const Profile light(cmsCreateRGBProfile(&white, &primaries, curves));
    const Transform transform(cmsCreateTransform(
        profile.get(), TYPE_RGB_FLT, light.get(), TYPE_RGB_FLT, kIntent, kExact));
    if (!transform) return false;
    const std::vector<float> columns = Transformed(transform, {1, 0, 0, 0, 1, 0, 0, 0, 1});
    for (int i = 0; i < 9; ++i) matrix_[i % 3][i / 3] = columns[i] / light_[i / 3].back();
    return true;
  }

  std::vector<float> light_[3];  // of i / kTop
  std::vector<float> value_;     // of light i / kTop, and the last one twice
  float matrix_[3][3] = {};
};

// For 8 bits Little CMS has a fast path.
void ConvertRow8(const Transform& transform,
                 size_t row,
                 std::vector<uint8_t>& in,
                 std::vector<uint16_t>& out,
                 Image* image) {
  const size_t width = image->width, first = row * width;
  for (size_t i = 0; i < 3 * width; ++i) {
    in[i] = static_cast<uint8_t>(255.0f * image->Plane(i % 3)[first + i / 3] + 0.5f);
  }
  cmsDoTransform(transform.get(), in.data(), out.data(), static_cast<cmsUInt32Number>(width));
  for (size_t i = 0; i < 3 * width; ++i) {
    image->Plane(i % 3)[first + i / 3] = static_cast<float>(out[i]) / 65535.0f;
  }
}

void ConvertRowExactly(const Transform& transform,
                       size_t row,
                       std::vector<float>& buffer,
                       Image* image) {
  const size_t width = image->width, first = row * width;
  for (size_t i = 0; i < 3 * width; ++i) buffer[i] = image->Plane(i % 3)[first + i / 3];
  cmsDoTransform(
      transform.get(), buffer.data(), buffer.data(), static_cast<cmsUInt32Number>(width));
  for (size_t i = 0; i < 3 * width; ++i) {
    image->Plane(i % 3)[first + i / 3] = Clamped(buffer[i]);
  }
}

// Returns false if the profile cannot be used.
bool ConvertColors(const Profile& profile, int bits, Image* image) {
  const Profile srgb(cmsCreate_sRGBProfile());
  const Transform exact(
      cmsCreateTransform(profile.get(), TYPE_RGB_FLT, srgb.get(), TYPE_RGB_FLT, kIntent, kExact));
  if (!exact) return false;
  if (AreNear(GridColors(), Transformed(exact, GridColors()), kSame)) return true;
  if (const auto shaper = MatrixShaper::Of(profile, exact)) {
    for (size_t i = 0; i < image->PlaneSize(); ++i) {
      shaper->Convert(image->Plane(0) + i, image->Plane(1) + i, image->Plane(2) + i);
    }
    return true;
  }
  if (bits > 8) {
    std::vector<float> buffer(size_t{3} * image->width);
    for (int y = 0; y < image->height; ++y) ConvertRowExactly(exact, y, buffer, image);
    return true;
  }
  const Transform quick(
      cmsCreateTransform(profile.get(), TYPE_RGB_8, srgb.get(), TYPE_RGB_16, kIntent, kKeepBlack));
  if (!quick) return false;
  std::vector<uint8_t> in(size_t{3} * image->width);
  std::vector<uint16_t> out(in.size());
  for (int y = 0; y < image->height; ++y) ConvertRow8(quick, y, in, out, image);
  return true;
}

// Returns false if the profile cannot be used.
bool ConvertTones(const Profile& profile, bool gray, int bits, int channels, Image* image) {
  const std::vector<float> table = ToneTable(profile, gray, bits > 8 ? 65536 : 256);
  if (table.empty()) return false;
  if (IsIdentity(table)) return true;
  const float top = static_cast<float>(table.size() - 1);
  const size_t n = image->PlaneSize() * channels;
  for (size_t i = 0; i < n; ++i) {
    image->data[i] = table[static_cast<size_t>(image->data[i] * top + 0.5f)];
  }
  return true;
}

std::string Saved(const Profile& profile) {
  cmsUInt32Number size = 0;
  if (!profile || !cmsSaveProfileToMem(profile.get(), nullptr, &size)) {
    throw Error(ErrorCode::kInternal, "no colour profile of sRGB can be made");
  }
  std::string bytes(size, '\0');
  cmsSaveProfileToMem(profile.get(), bytes.data(), &size);
  // A fixed creation date, so that equal pictures give equal files.
  constexpr size_t kDateAt = 24;
  const std::string date("\x07\xE8\0\x01\0\x01\0\0\0\0\0\0", 12);
  return bytes.replace(kDateAt, date.size(), date);
}

}  // namespace

std::string ColorTagProblem(const ColorTag& tag) {
  std::string problem;
  const Profile profile = OpenProfile(tag, &problem);
  if (profile && ToneTable(profile, IsGray(tag), 2).empty())
    problem = "its colour profile is damaged";
  return problem;
}

std::string ConvertToSrgb(const ColorTag& tag, int bits, Image* image) {
  std::string problem;
  const Profile profile = OpenProfile(tag, &problem);
  if (!profile || image->Empty()) return problem;
  const int channels = image->channels >= 3 ? 3 : 1;
  const bool followed = IsGray(tag) || channels == 1
                            ? ConvertTones(profile, IsGray(tag), bits, channels, image)
                            : ConvertColors(profile, bits, image);
  return followed ? "" : "its colour profile is damaged";
}

const std::string& SrgbProfile() {
  static const std::string bytes = Saved(Profile(cmsCreate_sRGBProfile()));
  return bytes;
}

const std::string& SrgbGrayProfile() {
  static const std::string bytes = Saved(SrgbGray());
  return bytes;
}

}  // namespace color3d
