#include "core/colorizer/personal/scene_colorizers.h"

#include <torch/types.h>

#include <algorithm>
#include <map>
#include <tuple>

#include "core/base/error.h"
#include "core/colorizer/personal/personal_colorizer.h"
#include "core/encoder/torch_errors.h"

namespace color3d {
namespace {

// Maximum number of pictures in an encoder pass. More cost memory and are no faster.
constexpr size_t kMaxStack = 8;

struct Job {
  const PersonalColorizer* colorizer;
  const Image* luminance;
  Image* answer;
  Image small;  // at the colorizer's training size
};

void ColorizeStack(std::span<const Job* const> jobs) {
  std::vector<torch::Tensor> padded;
  for (const Job* job : jobs) padded.push_back(job->colorizer->Padded(job->small));
  const TapEncoder& encoder = jobs.front()->colorizer->encoder();
  const std::vector<torch::Tensor> taps = encoder.Taps(encoder.Input(torch::cat(padded)));
  for (size_t i = 0; i < jobs.size(); ++i) {
    std::vector<torch::Tensor> own;
    for (const torch::Tensor& tap : taps) {
      own.push_back(tap.narrow(0, static_cast<int64_t>(i), 1));
    }
    ColorPrediction prediction =
        jobs[i]->colorizer->PredictFromTaps(own, padded[i], jobs[i]->small, *jobs[i]->luminance);
    *jobs[i]->answer = std::move(prediction.ab);
  }
}

}  // namespace

std::vector<Image> ColorizeRouted(std::span<const RoutedPicture> pictures,
                                  const ColorizerLookup& lookup) {
  std::map<std::string, std::shared_ptr<const Colorizer>> colorizers;
  for (const RoutedPicture& picture : pictures) {
    if (colorizers.contains(picture.scene)) continue;
    const auto colorizer = lookup(picture.scene);
    if (!colorizer) {
      throw Error(
          ErrorCode::kNotFound, "scene '{}' has no colorizer; personalize it first", picture.scene);
    }
    colorizers[picture.scene] = colorizer;
  }
  for (const RoutedPicture& picture : pictures) PersonalColorizer::Check(*picture.luminance);
  std::vector<Image> answers(pictures.size());
  std::vector<Job> jobs;
  for (size_t i = 0; i < pictures.size(); ++i) {
    const Image& luminance = *pictures[i].luminance;
    const Colorizer& colorizer = *colorizers.at(pictures[i].scene);
    const auto* personal = dynamic_cast<const PersonalColorizer*>(&colorizer);
    if (personal != nullptr && personal->UsesFrozenTaps()) {
      jobs.push_back({personal, &luminance, &answers[i], personal->AtInferenceSize(luminance)});
    } else {
      answers[i] = colorizer.Colorize(luminance);  // adapters run inside the encoder
    }
  }
  using Shape = std::tuple<std::string, int, int>;
  std::map<Shape, std::vector<const Job*>> stacks;
  for (const Job& job : jobs) {
    const auto [width, height] = PersonalColorizer::PaddedSize(job.small);
    stacks[{job.colorizer->encoder().digest(), width, height}].push_back(&job);
  }
  WithTorchErrors("colorizer", [&] {
    torch::NoGradGuard no_grad;
    for (const auto& [shape, stack] : stacks) {
      for (size_t begin = 0; begin < stack.size(); begin += kMaxStack) {
        const size_t count = std::min(kMaxStack, stack.size() - begin);
        stack.front()->colorizer->SetThreads();
        ColorizeStack(std::span(stack).subspan(begin, count));
      }
    }
  });
  return answers;
}

}  // namespace color3d
