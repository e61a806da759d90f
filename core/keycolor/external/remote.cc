#include "core/keycolor/external/remote.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/image/guided_upsample.h"
#include "core/keycolor/picture_checks.h"

namespace color3d {
namespace {

constexpr int64_t kMinPixels = 64 * 64;  // minimum size of a picture
constexpr double kMaxAspectDeviation =
    0.02;  // maximum deviation of the aspect ratio, beyond rounding to px
constexpr double kNotableDifference = 5.0;  // mean |dL| above which a warning is given

[[noreturn]] void Refuse(const RemoteOptions& options, const std::string& why) {
  throw Error(ErrorCode::kFailedPrecondition, "the backend '{}' {}", options.name, why);
}

std::string Listing(const std::set<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "nothing" : text;
}

void RequireCapabilities(const RemoteOptions& options, const RemoteInfo& info) {
  std::vector<std::string> needed;
  if (!options.prompt.empty()) needed.push_back(capability::kTextPrompt);
  if (!options.reference.Empty()) needed.push_back(capability::kReferenceImage);
  if (!options.points.empty()) needed.push_back(capability::kColorPoints);
  if (needed.empty()) needed.push_back(capability::kAutomatic);
  if (!options.mask.Empty()) needed.push_back(capability::kMask);
  for (const std::string& name : needed) {
    if (info.capabilities.contains(name)) continue;
    Refuse(options,
           fmt::format("does not support {} (it supports: {}); leave that input out or use another "
                       "backend",
                       name,
                       Listing(info.capabilities)));
  }
}

// The photo, reduced to the maximum size of the backend.
Image PictureToSend(const Image& luminance, const RemoteOptions& options, const RemoteInfo& info) {
  const auto pixels = static_cast<int64_t>(luminance.PlaneSize());
  Image gray = luminance;
  if (info.max_pixels > 0 && pixels > info.max_pixels) {
    if (info.max_pixels < kMinPixels) {
      Refuse(options,
             fmt::format("accepts at most {} pixels per picture, but at least {} are needed",
                         info.max_pixels,
                         kMinPixels));
    }
    const double scale =
        std::sqrt(static_cast<double>(info.max_pixels) / static_cast<double>(pixels));
    gray = Resize(luminance,
                  std::max(1, static_cast<int>(luminance.width * scale)),
                  std::max(1, static_cast<int>(luminance.height * scale)));
  }
  for (float& value : gray.data) value = static_cast<float>(GrayFromLuminance(value));
  return gray;
}

std::string HexColor(const ColorHint& hint, double l) {
  const RgbColor rgb = SrgbFromLab(LabColor{l, hint.a, hint.b});
  const auto byte = [](double value) { return static_cast<unsigned>(std::lround(value * 255.0)); };
  char text[8];
  std::snprintf(text, sizeof(text), "#%02x%02x%02x", byte(rgb.r), byte(rgb.g), byte(rgb.b));
  return text;
}

// Points in coordinates of the picture that is sent, with the photo's luminance.
std::vector<RemotePoint> PointsToSend(const Image& luminance,
                                      const std::vector<ColorHint>& hints,
                                      double scale_x,
                                      double scale_y) {
  std::vector<RemotePoint> points;
  for (const ColorHint& hint : hints) {
    if (hint.shape != ColorHint::Shape::kDisc || hint.fill == ColorHint::Fill::kAutomatic) {
      throw InvalidArgument(
          "a backend takes points with colours; give lines, regions and labels "
          "without a backend");
    }
    if (!(hint.x_px >= 0.0 && hint.x_px < luminance.width && hint.y_px >= 0.0 &&
          hint.y_px < luminance.height)) {
      throw InvalidArgument("the colour point at ({}, {}) lies outside the key view of {} px",
                            hint.x_px,
                            hint.y_px,
                            SizeText(luminance));
    }
    const double l = luminance.At(0, static_cast<int>(hint.y_px), static_cast<int>(hint.x_px));
    points.push_back({hint.x_px * scale_x, hint.y_px * scale_y, HexColor(hint, l)});
  }
  return points;
}

RemoteRequest MakeRequest(const Image& luminance,
                          const Image& gray,
                          const RemoteOptions& options,
                          const RemoteInfo& info) {
  RemoteRequest request;
  request.idempotency_key = options.idempotency_key;
  request.image_png = EncodePng16(gray);
  request.prompt = options.prompt;
  if (!options.reference.Empty()) request.reference_image = EncodePng8(options.reference);
  request.points = PointsToSend(luminance,
                                options.points,
                                static_cast<double>(gray.width) / luminance.width,
                                static_cast<double>(gray.height) / luminance.height);
  if (!options.mask.Empty()) {
    request.mask_png = EncodePng8(Resize(options.mask, gray.width, gray.height));
  }
  if (info.capabilities.contains(capability::kSeed)) request.seed = options.seed;
  return request;
}

// Decodes the answer and checks that it is a PNG of the sent picture's shape.
Image ReadAnswer(const std::string& bytes, const Image& sent, const RemoteOptions& options) {
  const std::string what = "the answer";
  ImageLimits limits;
  // The answer may be larger, up to a bound.
  limits.max_pixels = std::max<int64_t>(kMinPixels, 4 * static_cast<int64_t>(sent.PlaneSize()));
  Image answer;
  try {
    const ImageInfo probe = ProbeImage(bytes, what, limits);
    if (probe.format != ImageFormat::kPng) throw InvalidArgument("{} is not a PNG file", what);
    answer = DecodeImage(bytes, what);
  } catch (const Error& error) {
    Refuse(options, std::string("did not answer with a usable picture: ") + error.what());
  }
  const double expected = static_cast<double>(sent.width) / sent.height;
  const double rounding = 1.0 / std::min({answer.width, answer.height, sent.width, sent.height});
  const double ratio = static_cast<double>(answer.width) / answer.height / expected;
  if (std::abs(std::log(ratio)) > kMaxAspectDeviation + rounding) {
    Refuse(options,
           "answered with " + SizeText(answer) + " px to a picture of " + SizeText(sent) +
               " px; the shape must be the same");
  }
  if (answer.channels != 3) Refuse(options, "answered with a grey picture");
  return answer;
}

void CheckAnswerLuminance(const Image& luminance,
                          const Image& answer,
                          const RemoteOptions& options,
                          RemoteSolution* solution) {
  const LuminanceAgreement agreement =
      CompareLuminance(Resize(luminance, answer.width, answer.height), answer);
  solution->mean_luminance_difference = agreement.mean_difference;
  solution->luminance_correlation = agreement.correlation;
  if (!agreement.SameSubject()) {
    Refuse(options,
           fmt::format("answered with a picture of something else (correlation "
                       "of luminances {:.3g}, required > {})",
                       agreement.correlation,
                       LuminanceAgreement::kMinCorrelation));
  }
  if (agreement.mean_difference > kNotableDifference) {
    solution->warnings.push_back(fmt::format(
        "the backend '{}' changed the luminance by {:.3g} L units on average; the photo's "
        "luminance was restored",
        options.name,
        agreement.mean_difference));
  }
}

void ClearOutside(const Image& mask, Image* ab) {
  if (mask.Empty()) return;
  for (int c = 0; c < 2; ++c) {
    for (size_t i = 0; i < mask.PlaneSize(); ++i) ab->Plane(c)[i] *= mask.data[i];
  }
}

void CheckMask(const Image& luminance, const Image& mask) {
  if (mask.Empty()) return;
  if (mask.channels != 1 || mask.width != luminance.width || mask.height != luminance.height) {
    throw InvalidArgument(
        "the mask is {} px with {} channels, the key view {} px; save it grey at the key view's "
        "size",
        SizeText(mask),
        mask.channels,
        SizeText(luminance));
  }
}

}  // namespace

RemoteSolution KeyColorFromRemote(const Image& luminance,
                                  const RemoteOptions& options,
                                  RemoteColorizer& remote,
                                  ProgressObserver& progress,
                                  const CancellationToken& cancel) {
  CheckMask(luminance, options.mask);
  RemoteSolution solution;
  solution.info = remote.GetInfo(progress, cancel);
  RequireCapabilities(options, solution.info);
  const Image gray = PictureToSend(luminance, options, solution.info);
  solution.sent_width = gray.width;
  solution.sent_height = gray.height;
  const RemoteRequest request = MakeRequest(luminance, gray, options, solution.info);
  const Image answer = ReadAnswer(remote.Colorize(request, progress, cancel), gray, options);
  solution.answer_width = answer.width;
  solution.answer_height = answer.height;

  const Image lab = LabFromSrgb(answer);
  Image ab = ChromaOfLab(lab);
  CheckAnswerLuminance(luminance, lab, options, &solution);
  const ChromaLevel chroma = MeasureChroma(lab);
  if (chroma.IsGray()) {
    Refuse(options,
           fmt::format("answered without colour (mean chroma {:.3g} Lab units)", chroma.mean));
  }
  if (ab.width != luminance.width || ab.height != luminance.height) {
    solution.warnings.push_back(fmt::format(
        "the backend '{}' coloured the photo at {} px; its colours were resampled to {} px",
        options.name,
        SizeText(ab),
        SizeText(luminance)));
    ab = ab.width < luminance.width ? UpsampleGuided(ab, luminance)
                                    : Resize(ab, luminance.width, luminance.height);
  }
  solution.ab = std::move(ab);
  ClearOutside(options.mask, &solution.ab);
  return solution;
}

}  // namespace color3d
