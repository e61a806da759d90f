#include "core/stage/coloring/recolored_views.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/carry/confidence.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/box_mean.h"
#include "core/image/codec.h"
#include "core/scene/photo_masks.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/carry_facts.h"
#include "core/stage/formats/edited_share.h"
#include "core/stage/formats/key_views.h"
#include "core/stage/sources/given_colors.h"

namespace color3d {
namespace {

// Carried shares are unsure by this distance, px.
constexpr int kShareReachPx = 2;
// Standard deviation of a carried colour, Lab units.
constexpr float kCarriedDeviation = 3.0f;
// Probabilities below the first count as not edited, above the second as edited.
constexpr float kNotEdited = 0.2f, kEdited = 0.8f;

// Mean of the carried share over the reach of its error, weighted by confidence.
Image SpreadShare(const Image& share, const Image& confidence) {
  Image weighted = share;
  for (size_t i = 0; i < weighted.data.size(); ++i) weighted.data[i] *= confidence.data[i];
  weighted = BoxMean(weighted, kShareReachPx);
  const Image weight = BoxMean(confidence, kShareReachPx);
  for (size_t i = 0; i < weighted.data.size(); ++i) {
    weighted.data[i] = std::clamp(weighted.data[i] / std::max(weight.data[i], 1e-6f), 0.0f, 1.0f);
  }
  return weighted;
}

// Weight of a carried colour against what is inferred, 0..1.
float CarriedWeight(float confidence) {
  return confidence < static_cast<float>(kMinMatchProbability)
             ? 0.0f
             : std::min(1.0f, confidence / kDecisiveConfidence);
}

// Share of the change at this colour that the change field proposes at this place.
float ProposedShare(const EditModel::Answer& by_color, float a, float b) {
  const float square =
      by_color.change[0] * by_color.change[0] + by_color.change[1] * by_color.change[1];
  if (square < 1.0f) return 0.0f;
  return std::clamp((by_color.change[0] * a + by_color.change[1] * b) / square, 0.0f, 1.0f);
}

FusedColor UneditedColor(const Image& lab) {
  FusedColor color{ChromaOfLab(lab), Image(lab.width, lab.height, kProvenancePlanes)};
  std::fill_n(color.provenance.Plane(kSeenPlane), lab.PlaneSize(), 1.0f);
  return color;
}

}  // namespace

std::unique_ptr<const ViewRecolorer> ViewRecolorer::Read(const Scene& scene,
                                                         const ViewImages& images,
                                                         const ViewPositions& positions,
                                                         const Colorizer& colorizer,
                                                         const StageContext& context) {
  if (!context.HasInput(artifact::kKeyView) ||
      ReadEditedShare(context, artifact::kKeyColor, 1, 1).Empty()) {
    return nullptr;
  }
  return std::unique_ptr<const ViewRecolorer>(
      new ViewRecolorer(scene, images, positions, colorizer, context));
}

ViewRecolorer::ViewRecolorer(const Scene& scene,
                             const ViewImages& images,
                             const ViewPositions& positions,
                             const Colorizer& colorizer,
                             const StageContext& context)
    : scene_(scene), images_(images), positions_(positions), context_(context) {
  std::vector<int> views = {ReadKeyView(context, scene)};
  for (const std::string& folder : AdditionalKeyViewFolders(context)) {
    views.push_back(
        scene.FindView(ReadJson(context, folder + artifact::kKeyColorFacts).value("view", "")));
  }
  std::vector<EditedPicture> edits;
  std::vector<Correction> corrections;
  for (const int view : views) {
    const Image lab = LabFromSrgb(images.Srgb(view));
    if (lab.channels != 3) continue;  // a grey photo shows no change
    KeyView key;
    if (keys_.empty()) {
      key.color = ReadKeyColor(context, lab.width, lab.height);
      ClearMasked(images.Mask(view).get(), &key.color.confidence);
      key.edited = ReadEditedShare(context, artifact::kKeyColor, lab.width, lab.height);
    } else {
      key.color = ReadAdditionalKeyColor(context, scene, view, images);
      key.edited = ReadAdditionalEditedShare(context, scene, view, images);
    }
    for (size_t i = 0; i < key.edited.data.size(); ++i) {
      key.edited.data[i] = std::min(key.edited.data[i], key.color.confidence.data[i]);
    }
    edits.push_back({lab, key.color.ab, key.edited});
    corrections.push_back({OwnPicture(view, lab), key.color.ab, key.color.confidence});
    keys_.emplace(view, std::move(key));
  }
  by_color_.emplace(edits);
  try {
    by_place_ = colorizer.Correct(corrections);
  } catch (const Error& e) {
    // Without feature neighbours similar places are not known.
    if (e.code() != ErrorCode::kFailedPrecondition) throw;
  }
}

PlacedPicture ViewRecolorer::OwnPicture(int view, const Image& lab) const {
  PlacedPicture picture{LuminanceOfLab(lab), ChromaOfLab(lab), {}, {}};
  picture.position =
      positions_.Of(view, images_.WorkingCamera(view), picture.luminance, images_.Mask(view).get());
  return picture;
}

std::optional<FusedColor> ViewRecolorer::Recolor(int view) const {
  const Image srgb = images_.Srgb(view);
  if (srgb.channels != 3 || IsGray(srgb)) return std::nullopt;
  const Image lab = LabFromSrgb(srgb);
  const auto key = keys_.find(view);
  return key != keys_.end() ? OfKeyView(key->second, lab) : OfOtherView(view, lab);
}

FusedColor ViewRecolorer::OfKeyView(const KeyView& key, const Image& lab) const {
  FusedColor color = UneditedColor(lab);
  MixIn(key.color.ab, key.color.confidence, &color.ab);
  return color;
}

FusedColor ViewRecolorer::OfOtherView(int view, const Image& lab) const {
  const CarriedColor carried = ReadCarried(context_, scene_.views[view], lab.width, lab.height);
  Image share = ReadEditedShare(
      context_, ViewArtifact(artifact::kCarried, scene_.views[view]), lab.width, lab.height);
  if (share.Empty()) share = Image(lab.width, lab.height, 1);
  share = SpreadShare(share, carried.confidence);
  CorrectedColor by_place{Image(lab.width, lab.height, 2), Image(lab.width, lab.height, 1), {}, {}};
  if (by_place_) by_place = by_place_->Predict(OwnPicture(view, lab), 0);
  const float share_of_all = by_color_->EditedShareOfAll();
  FusedColor color = UneditedColor(lab);
  for (size_t i = 0; i < lab.PlaneSize(); ++i) {
    const float own[2] = {lab.Plane(1)[i], lab.Plane(2)[i]};
    const EditModel::Answer by_color = by_color_->At(lab.Plane(0)[i], own[0], own[1]);
    const float proposed =
        ProposedShare(by_color, by_place.change.Plane(0)[i], by_place.change.Plane(1)[i]);
    const float inferred =
        std::min(1.0f, proposed + (1.0f - by_place.share.data[i]) * share_of_all);
    const float weight = CarriedWeight(carried.confidence.data[i]);
    const float prior = weight * share.data[i] + (1.0f - weight) * inferred;
    const float posterior = EditedPosterior(prior, by_color.likelihood_ratio);
    const float edited = std::clamp((posterior - kNotEdited) / (kEdited - kNotEdited), 0.0f, 1.0f);
    // Inverse variances weight the change at this colour and the carried one.
    const float variance = kCarriedDeviation * kCarriedDeviation;
    const float of_carried = weight * by_color.variance / (by_color.variance + variance);
    for (int c = 0; c < 2; ++c) {
      const float carried_change = carried.ab.Plane(c)[i] - own[c];
      color.ab.Plane(c)[i] +=
          edited * (of_carried * carried_change + (1.0f - of_carried) * by_color.change[c]);
    }
    const float guess = edited * (1.0f - weight);
    color.provenance.Plane(kSeenPlane)[i] = 1.0f - guess;
    color.provenance.Plane(kInferredPlane)[i] = guess;
  }
  return color;
}

}  // namespace color3d
