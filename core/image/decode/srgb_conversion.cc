#include "core/image/decode/srgb_conversion.h"

#include <lcms2.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/error.h"

namespace color3d {
namespace {

// Half a step more than what rounding to 8 bits changes.
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

bool IsGray(const Profile& profile) { return cmsGetColorSpace(profile.get()) == cmsSigGrayData; }

// Of what a file says by numbers.
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

// Null, with `problem` said, when the tag cannot be followed; null without when there is nothing to
// follow.
Profile OpenProfile(const ColorTag& tag, std::string* problem) {
  *problem = tag.problem;
  if (!problem->empty()) return nullptr;
  if (tag.profile.empty()) {
    if (tag.gamma == 0.0) return nullptr;
    Profile profile = ProfileOfNumbers(tag);
    if (!profile) *problem = "its primaries are nonsense";
    return profile;
  }
  Profile profile(
      cmsOpenProfileFromMem(tag.profile.data(), static_cast<cmsUInt32Number>(tag.profile.size())));
  if (!profile) {
    *problem = "its colour profile is damaged";
    return nullptr;
  }
  const cmsProfileClassSignature kind = cmsGetDeviceClass(profile.get());
  const bool is_device = kind == cmsSigInputClass || kind == cmsSigDisplayClass ||
                         kind == cmsSigOutputClass || kind == cmsSigColorSpaceClass;
  const cmsColorSpaceSignature space = cmsGetColorSpace(profile.get());
  if (!is_device || (space != cmsSigRgbData && space != cmsSigGrayData)) {
    *problem = "its colour profile is not one of RGB or grey";
    return nullptr;
  }
  return profile;
}

float Clamped(float v) { return v > 0.0f ? std::min(v, 1.0f) : 0.0f; }  // NaN: 0

// What the grey i / (count - 1) becomes, for all i; empty when the profile cannot be followed.
std::vector<float> ToneTable(const Profile& profile, size_t count) {
  const bool gray = IsGray(profile);
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

// Whether colours on a grid stay what they are.
bool IsIdentity(void* transform) {
  constexpr int kSteps = 7;
  std::vector<float> in, out(3 * kSteps * kSteps * kSteps);
  for (int i = 0; i < kSteps * kSteps * kSteps; ++i) {
    for (const int step : {i % kSteps, i / kSteps % kSteps, i / kSteps / kSteps}) {
      in.push_back(static_cast<float>(step) / (kSteps - 1));
    }
  }
  cmsDoTransform(transform, in.data(), out.data(), static_cast<cmsUInt32Number>(in.size() / 3));
  for (size_t i = 0; i < in.size(); ++i) {
    if (!(std::abs(out[i] - in[i]) <= kSame)) return false;
  }
  return true;
}

// Little CMS has a quick way for 8 bits, and an exact one for floats.
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

// False when the profile cannot be followed.
bool ConvertColors(const Profile& profile, int bits, Image* image) {
  const Profile srgb(cmsCreate_sRGBProfile());
  const Transform exact(
      cmsCreateTransform(profile.get(), TYPE_RGB_FLT, srgb.get(), TYPE_RGB_FLT, kIntent, kExact));
  if (!exact) return false;
  if (IsIdentity(exact.get())) return true;
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

// False when the profile cannot be followed.
bool ConvertTones(const Profile& profile, int bits, int channels, Image* image) {
  const std::vector<float> table = ToneTable(profile, bits > 8 ? 65536 : 256);
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
  // The date of its making: equal pictures are to be equal files.
  constexpr size_t kDateAt = 24;
  const std::string date("\x07\xE8\0\x01\0\x01\0\0\0\0\0\0", 12);
  return bytes.replace(kDateAt, date.size(), date);
}

}  // namespace

std::string ColorTagProblem(const ColorTag& tag) {
  std::string problem;
  const Profile profile = OpenProfile(tag, &problem);
  if (profile && ToneTable(profile, 2).empty()) problem = "its colour profile is damaged";
  return problem;
}

std::string ConvertToSrgb(const ColorTag& tag, int bits, Image* image) {
  std::string problem;
  const Profile profile = OpenProfile(tag, &problem);
  if (!profile || image->Empty()) return problem;
  const int channels = image->channels >= 3 ? 3 : 1;
  const bool followed = IsGray(profile) || channels == 1
                            ? ConvertTones(profile, bits, channels, image)
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
