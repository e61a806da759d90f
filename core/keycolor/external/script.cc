#include "core/keycolor/external/script.h"

#include <fmt/format.h>
#include <torch/script.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <sstream>
#include <string>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/encoder/image_tensors.h"
#include "core/image/codec.h"
#include "core/image/crop.h"
#include "core/image/guided_upsample.h"
#include "core/image/image_checks.h"

namespace color3d {
namespace {

constexpr int kMaxSidePx = 1024;
constexpr int kMultiple = 32;
constexpr int kMaxAnswerSidePx = 16384;
constexpr float kMaxChroma = 150.0f;
constexpr float kRgbMargin = 0.1f;

Error Refused(const std::filesystem::path& file, const std::string& why) {
  return InvalidArgument("the TorchScript file {} {}", file.filename().string(), why);
}

// First line of an error message of torch or the script, without backtrace.
std::string FirstLine(const std::exception& error) {
  const std::string text = error.what();
  const size_t begin = text.find_first_not_of(" \n");
  if (begin == std::string::npos) return "no message";
  // TorchScript puts the exception last: "AssertionError: ...".
  const size_t raised = text.rfind("Error: ");
  const size_t from = raised == std::string::npos ? begin : text.rfind('\n', raised) + 1;
  return text.substr(from, std::min<size_t>(text.find('\n', from) - from, 200));
}

torch::Tensor FirstTensor(const torch::IValue& answer, const std::filesystem::path& file) {
  if (answer.isTensor()) return answer.toTensor();
  if (answer.isTensorList() && answer.toTensorList().size() > 0)
    return answer.toTensorList().get(0);
  if (answer.isTuple() && !answer.toTuple()->elements().empty() &&
      answer.toTuple()->elements()[0].isTensor()) {
    return answer.toTuple()->elements()[0].toTensor();
  }
  throw Refused(file, "returned a " + answer.tagKind() + ", but must return a tensor");
}

Image CheckedAnswer(const torch::Tensor& answer, const std::filesystem::path& file) {
  std::ostringstream shape;
  shape << answer.sizes();
  const bool fits = answer.dim() == 4 && answer.size(0) == 1 &&
                    (answer.size(1) == 2 || answer.size(1) == 3) && answer.size(2) >= 1 &&
                    answer.size(3) >= 1 && answer.size(2) <= kMaxAnswerSidePx &&
                    answer.size(3) <= kMaxAnswerSidePx;
  if (!fits || !answer.is_floating_point()) {
    throw Refused(
        file,
        fmt::format("returned a tensor of shape {} and type {}, but must return [1,2,h,w] (ab) "
                    "or [1,3,h,w] (sRGB) of floats",
                    shape.str(),
                    std::string(answer.dtype().name())));
  }
  Image image = ImageFromTensor(answer.detach().to(torch::kCPU));
  const float low = image.channels == 2 ? -kMaxChroma : -kRgbMargin;
  const float high = image.channels == 2 ? kMaxChroma : 1.0f + kRgbMargin;
  for (float value : image.data) {
    if (value >= low && value <= high) continue;
    throw Refused(file,
                  fmt::format("returned the value {}; allowed are {} to {}", value, low, high));
  }
  return image;
}

Image Run(const Image& luminance, const std::filesystem::path& file) {
  torch::NoGradGuard no_grad;
  torch::jit::Module module;
  try {
    module = torch::jit::load(file.string(), torch::kCPU);
    module.eval();
  } catch (const std::exception& error) {
    throw Refused(file, "cannot be loaded: " + FirstLine(error));
  }
  torch::IValue answer;
  try {
    answer = module.forward({PadByReplication(TensorFromImage(luminance), kMultiple)});
  } catch (const std::exception& error) {
    throw Refused(file, "failed: " + FirstLine(error));
  }
  return CheckedAnswer(FirstTensor(answer, file), file);
}

// Removes the padding; the answer covers the padded input.
Image Cropped(const Image& answer, const Image& luminance) {
  const auto part = [](int answer_px, int px) {
    const int padded = (px + kMultiple - 1) / kMultiple * kMultiple;
    return std::max(1, static_cast<int>(std::lround(static_cast<double>(answer_px) * px / padded)));
  };
  return Crop(
      answer, 0, 0, part(answer.width, luminance.width), part(answer.height, luminance.height));
}

}  // namespace

ScriptColor KeyColorFromScript(const Image& luminance, const std::filesystem::path& torchscript) {
  RequireLuminance(luminance, "the colouring of the key view");
  const Image small = FitWithin(luminance, kMaxSidePx);
  Image answer = Cropped(Run(small, torchscript), small);
  ScriptColor color;
  if (answer.channels == 3) {
    for (float& value : answer.data) value = std::clamp(value, 0.0f, 1.0f);
    const Image lab = LabFromSrgb(answer);
    const Image expected = Resize(luminance, lab.width, lab.height);
    for (size_t i = 0; i < lab.PlaneSize(); ++i) {
      color.luminance_deviation +=
          std::abs(lab.data[i] - expected.data[i]) / static_cast<double>(lab.PlaneSize());
    }
    answer = ChromaOfLab(lab);
  }
  const bool fits = answer.width == luminance.width && answer.height == luminance.height;
  color.ab = fits ? std::move(answer) : UpsampleGuided(answer, luminance);
  return color;
}

}  // namespace color3d
