#include "core/stage/film/between_anchors.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/carry/confidence.h"
#include "core/image/fill_holes.h"

namespace color3d {
namespace {

constexpr int kColorChannels = 3;  // a, b and the guessed share
const float kJustFollowed = std::nextafter(kDecisiveConfidence, 1.0f);
constexpr float kAnswerFollowed = 0.2f;  // and from which an answer goes along with it

// 1 where no colour needs to be inferred.
Image KnownPixels(const CarriedColor& of_anchors, const Image& carried_surely) {
  Image known = carried_surely;
  for (size_t i = 0; i < known.data.size(); ++i) {
    if (of_anchors.confidence.data[i] > kDecisiveConfidence) known.data[i] = 1.0f;
  }
  return known;
}

// Infers the colours of a frame where the anchors are not sure, and takes theirs elsewhere.
InferredColor InferBetweenAnchors(const CarriedColor& of_anchors,
                                  const Image& carried_surely,
                                  const Image& luminance,
                                  const ColorSources& sources) {
  InferredColor answer;
  if (UncertainShare(carried_surely, of_anchors) > kWorthInferring) {
    answer = sources.infer(luminance, KnownPixels(of_anchors, carried_surely));
  } else {
    answer = {Image(luminance.width, luminance.height, 2),
              Image(luminance.width, luminance.height, 1)};
    Image followed = of_anchors.confidence;
    for (float& value : followed.data) value = value > kDecisiveConfidence ? 1.0f : 0.0f;
    std::copy_n(of_anchors.ab.data.begin(), answer.ab.data.size(), answer.ab.data.begin());
    FillHoles(followed, &answer.ab);
  }
  for (size_t i = 0; i < luminance.PlaneSize(); ++i) {
    if (of_anchors.confidence.data[i] <= kDecisiveConfidence) continue;
    for (int c = 0; c < 2; ++c) answer.ab.Plane(c)[i] = of_anchors.ab.Plane(c)[i];
    if (!answer.distance.Empty()) answer.distance.data[i] = 0.0f;
  }
  return answer;
}

}  // namespace

FilmKey AnchorAsKey(int frame, const FusedColor& color) {
  const int width = color.ab.width, height = color.ab.height;
  Image channels(width, height, kColorChannels);
  std::ranges::copy(color.ab.data, channels.data.begin());
  for (size_t i = 0; i < channels.PlaneSize(); ++i) {
    const float guessed = color.provenance.Plane(kGuessedPlane)[i],
                inferred = color.provenance.Plane(kInferredPlane)[i];
    channels.Plane(2)[i] = guessed / std::max(guessed + inferred, 1e-6f);
  }
  return {frame, {std::move(channels), Image(width, height, 1, 1.0f)}};
}

CarriedColor BlendAnchors(CarriedColor before, const CarriedColor& behind, double place) {
  if (before.ab.Empty()) return behind;
  if (behind.ab.Empty()) return before;
  const auto share_behind = static_cast<float>(place);
  for (size_t i = 0; i < before.confidence.data.size(); ++i) {
    float& confidence = before.confidence.data[i];
    const float other = behind.confidence.data[i];
    float weight = confidence > kDecisiveConfidence ? confidence * (1.0f - share_behind) : 0.0f;
    float other_weight = other > kDecisiveConfidence ? other * share_behind : 0.0f;
    confidence = std::max(confidence, other);
    const float sum = weight + other_weight;
    if (sum == 0.0f) continue;
    for (int c = 0; c < before.ab.channels; ++c) {
      float& value = before.ab.Plane(c)[i];
      value = (weight * value + other_weight * behind.ab.Plane(c)[i]) / sum;
    }
  }
  return before;
}

double UncertainShare(const Image& carried_confidence, const CarriedColor& of_anchors) {
  const std::vector<float>& one = carried_confidence.data;
  const std::vector<float>& other = of_anchors.confidence.data;
  size_t open = 0;
  for (size_t i = 0; i < one.size(); ++i)
    open += one[i] <= kDecisiveConfidence && other[i] <= kDecisiveConfidence;
  return static_cast<double>(open) / static_cast<double>(one.size());
}

size_t FillUncertain(const CarriedColor& others, CarriedColor* color) {
  size_t filled = 0;
  for (size_t i = 0; i < others.confidence.data.size(); ++i) {
    float& confidence = color->confidence.data[i];
    if (confidence > kDecisiveConfidence || others.confidence.data[i] <= kDecisiveConfidence)
      continue;
    confidence = others.confidence.data[i];
    for (int c = 0; c < others.ab.channels; ++c) color->ab.Plane(c)[i] = others.ab.Plane(c)[i];
    ++filled;
  }
  return filled;
}

void FillFromNeighbor(const CarriedColor& answer, CarriedColor* color) {
  CarriedColor followed = answer;
  for (float& confidence : followed.confidence.data) {
    if (confidence > kAnswerFollowed) confidence = std::max(confidence, kJustFollowed);
  }
  FillUncertain(followed, color);
}

FusedColor ColorBetweenAnchors(const Image& luminance,
                               const CarriedColor& carried,
                               const CarriedColor& of_anchors,
                               const ColorSources& sources,
                               const CancellationToken& cancel) {
  ColorSources with_anchors = sources;
  with_anchors.infer = [&](const Image& l, const Image& carried_surely) {
    return InferBetweenAnchors(of_anchors, carried_surely, l, sources);
  };
  ThreadPool one(1);
  FusedColor fused = FuseViewColor(luminance, carried, with_anchors, one, cancel);
  // Guessed colours of an anchor count as guessed here, too.
  for (size_t i = 0; i < fused.provenance.PlaneSize(); ++i) {
    if (of_anchors.confidence.data[i] <= kDecisiveConfidence) continue;
    float& inferred = fused.provenance.Plane(kInferredPlane)[i];
    const float guessed = inferred * std::clamp(of_anchors.ab.Plane(2)[i], 0.0f, 1.0f);
    fused.provenance.Plane(kGuessedPlane)[i] += guessed;
    inferred -= guessed;
  }
  return fused;
}

}  // namespace color3d
