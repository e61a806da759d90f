#include "core/keycolor/words/prompt.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/base/range_check.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/image/guided_upsample.h"
#include "core/image/image_checks.h"
#include "core/keycolor/words/dense_similarity.h"

namespace color3d {
namespace {

// Texts of the background, for places that show none of the things.
constexpr const char* kBackgrounds[] = {"the background", "something else", "an empty surface"};
constexpr int kLargestPictureSidePx = 1536;  // size from which the finest windows are cropped
constexpr int kHintsPerSide = 64;
// Above the guided filter's defaults: a patch of CLIP covers several cells, so borders of regions
// are further from the edges of L. Not measured against the defaults.
constexpr int kPatchGuideRadius = 3;
constexpr float kPatchGuideVarianceFloor = 30.0f;

void CheckPictures(const Image& luminance, const Image& rest) {
  RequireLuminance(luminance, "the colouring of the key view");
  const bool fits =
      rest.channels == 2 && rest.width == luminance.width && rest.height == luminance.height;
  if (!rest.Empty() && !fits) {
    throw InvalidArgument(
        "the colours of the rest are {}x{} px with {} channels, but must be {}x{} px with 2",
        rest.width,
        rest.height,
        rest.channels,
        luminance.width,
        luminance.height);
  }
}

// Softmax over the planes in place.
void Softmax(double temperature, Image& planes) {
  for (size_t i = 0; i < planes.PlaneSize(); ++i) {
    float largest = planes.data[i];
    for (int c = 1; c < planes.channels; ++c) largest = std::max(largest, planes.Plane(c)[i]);
    double sum = 0.0;
    for (int c = 0; c < planes.channels; ++c) {
      float& value = planes.Plane(c)[i];
      value = static_cast<float>(std::exp((value - largest) / temperature));
      sum += value;
    }
    for (int c = 0; c < planes.channels; ++c) {
      planes.Plane(c)[i] = static_cast<float>(planes.Plane(c)[i] / sum);
    }
  }
}

// Probabilities of the phrases and, last, of the background, on the map's grid.
Image Probabilities(const Image& luminance,
                    const std::vector<ColorPhrase>& phrases,
                    const TextImageModel& model,
                    const PromptOptions& options,
                    ProgressObserver& progress,
                    const CancellationToken& cancel) {
  std::vector<std::vector<float>> texts;
  for (const ColorPhrase& phrase : phrases) texts.push_back(MeanTextFeature(model, phrase.thing));
  for (const char* background : kBackgrounds) texts.push_back(MeanTextFeature(model, background));
  const Image picture = SrgbFromLab(FitWithin(luminance, kLargestPictureSidePx));
  Image planes = DenseSimilarity(
      model, picture, texts, options.windows_per_side, options.map_side_px, progress, cancel);
  Softmax(options.temperature, planes);
  const int count = static_cast<int>(phrases.size());
  Image probabilities(planes.width, planes.height, count + 1);
  std::copy_n(planes.data.begin(), planes.PlaneSize() * count, probabilities.data.begin());
  for (int c = count; c < planes.channels; ++c) {
    for (size_t i = 0; i < planes.PlaneSize(); ++i) {
      probabilities.Plane(count)[i] += planes.Plane(c)[i];
    }
  }
  // Aligns the coarse borders of CLIP's patches with the edges of L.
  const Image guide = Resize(luminance, planes.width, planes.height);
  probabilities = UpsampleGuided(
      Resize(probabilities, std::max(1, planes.width / 4), std::max(1, planes.height / 4)),
      guide,
      kPatchGuideRadius,
      kPatchGuideVarianceFloor);
  for (float& value : probabilities.data) value = std::clamp(value, 0.0f, 1.0f);
  return probabilities;
}

struct Leader {
  int phrase = 0;     // index; the number of phrases: background
  float lead = 0.0f;  // lead over the second best
};

Leader LeaderAt(const Image& probabilities, size_t i, const std::vector<bool>& allowed) {
  Leader leader;
  float best = -1.0f;
  float second = 0.0f;
  for (int c = 0; c < probabilities.channels; ++c) {
    if (!allowed[c]) continue;
    const float value = probabilities.Plane(c)[i];
    if (value > best) {
      second = std::max(best, 0.0f);
      best = value;
      leader.phrase = c;
    } else {
      second = std::max(second, value);
    }
  }
  leader.lead = best - second;
  return leader;
}

std::vector<PromptRegion> FindRegions(const std::vector<ColorPhrase>& phrases,
                                      const Image& probabilities,
                                      double min_share) {
  std::vector<PromptRegion> regions;
  const std::vector<bool> all(probabilities.channels, true);
  std::vector<size_t> pixels(probabilities.channels, 0);
  for (size_t i = 0; i < probabilities.PlaneSize(); ++i) {
    ++pixels[LeaderAt(probabilities, i, all).phrase];
  }
  for (size_t p = 0; p < phrases.size(); ++p) {
    PromptRegion region;
    region.phrase = phrases[p];
    region.mask = Image(probabilities.width, probabilities.height, 1);
    const float* plane = probabilities.Plane(static_cast<int>(p));
    std::copy_n(plane, region.mask.data.size(), region.mask.data.begin());
    region.score = *std::max_element(region.mask.data.begin(), region.mask.data.end());
    region.share = static_cast<double>(pixels[p]) / static_cast<double>(region.mask.data.size());
    region.found = region.share >= min_share;
    regions.push_back(std::move(region));
  }
  return regions;
}

// The most certain pixel of each grid cell becomes a hint if its lead is large enough.
class HintPlacer {
 public:
  HintPlacer(const Image& luminance,
             const Image& rest,
             const Image& probabilities,
             const std::vector<PromptRegion>& regions,
             double seed_confidence)
      : luminance_(luminance),
        rest_(rest),
        probabilities_(probabilities),
        regions_(regions),
        seed_confidence_(seed_confidence) {
    for (const PromptRegion& region : regions) allowed_.push_back(region.found);
    allowed_.push_back(true);
  }

  std::vector<ColorHint> Place() const {
    const int cell =
        std::max(1, std::max(probabilities_.width, probabilities_.height) / kHintsPerSide);
    std::vector<ColorHint> hints;
    for (int top = 0; top < probabilities_.height; top += cell) {
      for (int left = 0; left < probabilities_.width; left += cell) {
        AddBestOfCell(left, top, cell, hints);
      }
    }
    return hints;
  }
  Image Confidence() const {
    Image map(probabilities_.width, probabilities_.height, 1);
    for (size_t i = 0; i < map.data.size(); ++i) {
      const Leader leader = LeaderAt(probabilities_, i, allowed_);
      const bool background = leader.phrase == static_cast<int>(regions_.size());
      map.data[i] = background ? 0.0f : leader.lead;
    }
    return Resize(map, luminance_.width, luminance_.height);
  }

 private:
  void AddBestOfCell(int left, int top, int cell, std::vector<ColorHint>& hints) const {
    Leader best;
    int best_x = 0;
    int best_y = 0;
    for (int y = top; y < std::min(top + cell, probabilities_.height); ++y) {
      for (int x = left; x < std::min(left + cell, probabilities_.width); ++x) {
        const size_t i = static_cast<size_t>(y) * probabilities_.width + x;
        const Leader leader = LeaderAt(probabilities_, i, allowed_);
        if (leader.lead <= best.lead) continue;
        best = leader;
        best_x = x;
        best_y = y;
      }
    }
    if (best.lead < seed_confidence_) return;
    ColorHint hint;
    hint.x_px = (best_x + 0.5) * luminance_.width / probabilities_.width;
    hint.y_px = (best_y + 0.5) * luminance_.height / probabilities_.height;
    hint.radius_px = 0.0;
    const int x = std::min(static_cast<int>(hint.x_px), luminance_.width - 1);
    const int y = std::min(static_cast<int>(hint.y_px), luminance_.height - 1);
    if (best.phrase < static_cast<int>(regions_.size())) {
      const Chroma chroma =
          ChromaAtLuminance(regions_[best.phrase].phrase.color.lab, luminance_.At(0, y, x));
      hint.a = chroma.a;
      hint.b = chroma.b;
    } else if (!rest_.Empty()) {
      hint.a = std::clamp(rest_.At(0, y, x), -128.0f, 128.0f);
      hint.b = std::clamp(rest_.At(1, y, x), -128.0f, 128.0f);
    }
    hints.push_back(hint);
  }

  const Image& luminance_;
  const Image& rest_;
  const Image& probabilities_;
  const std::vector<PromptRegion>& regions_;
  double seed_confidence_;
  std::vector<bool> allowed_;  // phrases that were found, and background
};

Error NoRegionFound(const std::vector<PromptRegion>& regions) {
  std::string text = "none of the things in the prompt was found in the key view:";
  for (const PromptRegion& region : regions) {
    text += fmt::format(" \"{}\" (best score {:.3g})", region.phrase.thing, region.score);
  }
  return Error(
      ErrorCode::kFailedPrecondition, "{}; name other things, or place colour hints", text);
}

}  // namespace

void PromptOptions::Validate() const {
  const RangeCheck check("prompt option");
  if (windows_per_side.empty()) throw InvalidArgument("prompt option windows_per_side is empty");
  for (const int count : windows_per_side) check("windows_per_side", count, 1, 8);
  check("temperature", temperature, 1e-4, 10.0);
  check("seed_confidence", seed_confidence, 0.0, 1.0);
  check("min_share", min_share, 0.0, 1.0);
  check("map_side_px", map_side_px, 32, 1024);
  hints.Validate();
}

PromptSolution KeyColorFromPrompt(const Image& luminance,
                                  const std::string& prompt,
                                  const TextImageModel& model,
                                  const Image& rest,
                                  const PromptOptions& options,
                                  const RunControl& control) {
  options.Validate();
  CheckPictures(luminance, rest);
  ParsedPrompt parsed = ParsePrompt(prompt);
  PromptSolution solution;
  solution.notes = std::move(parsed.notes);
  const Image probabilities =
      Probabilities(luminance, parsed.phrases, model, options, control.progress, control.cancel);
  solution.regions = FindRegions(parsed.phrases, probabilities, options.min_share);
  bool any = false;
  for (const PromptRegion& region : solution.regions) {
    any = any || region.found;
    if (region.found) continue;
    solution.notes.push_back(fmt::format(
        "\"{}\" was not found in the key view; its colour is not used", region.phrase.thing));
  }
  if (!any) throw NoRegionFound(solution.regions);
  const HintPlacer placer(
      luminance, rest, probabilities, solution.regions, options.seed_confidence);
  const std::vector<ColorHint> hints = placer.Place();
  if (hints.empty()) throw NoRegionFound(solution.regions);
  solution.confidence = placer.Confidence();
  solution.spread = KeyColorFromHints(luminance, hints, options.hints, control);
  solution.ab = std::move(solution.spread.ab);
  return solution;
}

}  // namespace color3d
