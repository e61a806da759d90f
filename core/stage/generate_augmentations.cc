#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/base/range_check.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/report/contact_sheet.h"
#include "core/scene/view_images.h"
#include "core/splat/raster/render.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/carry_facts.h"
#include "core/stage/run_stages.h"
#include "core/stage/sources/augmentation_sources.h"

namespace color3d {
namespace {

using Kind = AugmentationKind;
using nlohmann::ordered_json;

constexpr int kMaxSamples = 64;
constexpr int kRemoteSidePx = 1024;  // longer side of pictures sent to model servers
constexpr int kThumbnailPx = 320;
// Coverage of the scene by the key view above which no pictures are generated.
constexpr double kNothingToOutpaint = 0.9;
// The eight pictures of the paper, in order of priority.
constexpr Kind kOrder[] = {Kind::kNovelView,
                           Kind::kOutpaint,
                           Kind::kNovelView,
                           Kind::kOutpaint,
                           Kind::kAnimate,
                           Kind::kNovelView,
                           Kind::kOutpaint,
                           Kind::kOutpaint};

struct Outcome {
  std::vector<Augmentation> made;
  ordered_json left_out = ordered_json::array();
  void LeaveOut(const std::string& kind, const std::string& reason) {
    left_out.push_back({{"kind", kind}, {"reason", reason}});
  }
};

// Number of pictures of each kind. Turns of disabled kinds are dropped.
std::map<Kind, int> CountByKind(const AugmentationOptions& options) {
  std::map<Kind, int> counts;
  for (int i = 0; i < options.samples; ++i) {
    const Kind kind = kOrder[static_cast<size_t>(i) % std::size(kOrder)];
    const bool wanted = kind == Kind::kOutpaint  ? options.outpaint
                        : kind == Kind::kAnimate ? options.animate
                                                 : options.novel_views;
    if (wanted) ++counts[kind];
  }
  return counts;
}

// Coloured key view at working size.
Image KeyLab(const Scene& scene, int key, int max_side_px, const StageContext& context) {
  const AbMap color = ReadAbMap(context, artifact::kKeyColor);
  const ViewImages images(scene, context.scene_folder(), max_side_px, 0);
  const auto l = images.Luminance(key);
  return JoinLab(*l, Resize(color.ab, l->width, l->height));
}

KeyPicture ReadKeyPicture(const Scene& scene,
                          int key,
                          int max_side_px,
                          const StageContext& context) {
  const View& view = scene.views[static_cast<size_t>(key)];
  KeyPicture picture;
  picture.lab = KeyLab(scene, key, max_side_px, context);
  picture.camera = view.camera.Scaled(picture.lab.width, picture.lab.height);
  picture.cam_from_world = view.cam_from_world;
  return picture;
}

// Requests pictures of the kinds that the backend supports. Other kinds stay in `counts`.
void GenerateWithBackend(const AugmentationOptions& options,
                         const Image& key_srgb,
                         StageContext& context,
                         std::map<Kind, int>* counts,
                         Outcome* outcome) {
  const auto remote = context.Remote(options.backend);
  const RemoteInfo info = remote->GetInfo(context.progress(), context.cancel());
  bool asked = false;
  for (auto it = counts->begin(); it != counts->end();) {
    if (!info.capabilities.contains(AugmentationKindName(it->first))) {
      ++it;
      continue;
    }
    asked = true;
    std::vector<Augmentation> made =
        AugmentationsFromBackend(options, *remote, info, it->first, it->second, key_srgb, context);
    std::ranges::move(made, std::back_inserter(outcome->made));
    it = counts->erase(it);
  }
  if (asked || counts->empty()) return;
  throw Error(ErrorCode::kFailedPrecondition,
              "the backend '{}' generates none of the requested pictures (outpaint, "
              "animate, novel_view); omit it to use the embedded surrogates",
              options.backend);
}

// Renders the luminance geometry at that time, if it is among the inputs.
GeometryRenderer RendererFrom(double time_s, StageContext& context) {
  if (!context.HasInput(artifact::kGeometry)) return {};
  const auto model =
      std::make_shared<const GaussianModel>(ParseGaussians(context.ReadInput(artifact::kGeometry)));
  if (model->size() == 0) return {};
  return [model, time_s, &context](const Camera& camera, const Pose& cam_from_world) {
    RenderedView seen = RenderView(*model, camera, cam_from_world, context.pool(), 0.0f, time_s);
    return RenderedGeometry{std::move(seen.lab), std::move(seen.depth), std::move(seen.opacity)};
  };
}

void MakeSurrogates(const std::map<Kind, int>& counts,
                    const Surrogates& surrogates,
                    StageContext& context,
                    Outcome* outcome) {
  int64_t total = 0, done = 0;
  for (const auto& [kind, count] : counts) total += count;
  for (const auto& [kind, count] : counts) {
    const std::string name = AugmentationKindName(kind);
    const std::string obstacle = surrogates.Obstacle(kind);
    int poor = 0;
    for (int i = 0; obstacle.empty() && i < count; ++i) {
      context.ThrowIfCancelled();
      std::optional<GeneratedPicture> made = surrogates.Make(kind, i);
      if (made) {
        outcome->made.push_back(
            {AugmentationName(name, static_cast<size_t>(i)), name, "embedded", std::move(*made)});
      } else {
        ++poor;
      }
      context.ReportProgress(++done, total, "generating augmentations");
    }
    if (!obstacle.empty()) outcome->LeaveOut(name, obstacle);
    if (poor > 0) {
      outcome->LeaveOut(name, fmt::format("{} would show almost nothing of the key view", poor));
    }
  }
}

void SkipNeedless(const AugmentationOptions& options,
                  const StageContext& context,
                  std::map<Kind, int>* counts,
                  Outcome* outcome) {
  if (options.samples > 0) {
    const std::pair<Kind, bool> switches[] = {{Kind::kOutpaint, options.outpaint},
                                              {Kind::kAnimate, options.animate},
                                              {Kind::kNovelView, options.novel_views}};
    for (const auto& [kind, on] : switches) {
      if (!on) outcome->LeaveOut(AugmentationKindName(kind), "not asked for");
    }
  }
  const std::optional<double> coverage = ReadCarryFacts(context).coverage;
  if (coverage && *coverage >= kNothingToOutpaint && counts->erase(Kind::kOutpaint) > 0) {
    outcome->LeaveOut(
        AugmentationKindName(Kind::kOutpaint),
        fmt::format("the key view covers {} % of the scene: there is nothing to invent "
                    "around it",
                    static_cast<int>(100.0 * *coverage)));
  }
}

// Masked pixels must not be learnt, and their places in generated pictures are unknown.
void SkipMasked(std::map<Kind, int>* counts, Outcome* outcome) {
  for (const auto& [kind, count] : *counts) {
    outcome->LeaveOut(AugmentationKindName(kind), "parts of the key view are masked out");
  }
  counts->clear();
}

void WriteSheet(const KeyPicture& key, const Outcome& outcome, StageContext& context) {
  ContactSheet sheet;
  sheet.title = "Training pictures of the colorizer";
  sheet.subtitle = fmt::format(
      "The key view and {} pictures made from it or given; what carries no weight is dimmed.",
      outcome.made.size());
  sheet.ranked.push_back(
      {FitWithin(SrgbFromLab(key.lab), kThumbnailPx), "key view", "as coloured", true});
  for (const Augmentation& a : outcome.made) {
    Image srgb = SrgbFromLab(a.picture.lab);
    for (int c = 0; c < 3; ++c) {
      for (size_t i = 0; i < srgb.PlaneSize(); ++i) {
        srgb.Plane(c)[i] *= 0.35f + 0.65f * std::min(1.0f, 2.0f * a.picture.weight.data[i]);
      }
    }
    sheet.ranked.push_back({FitWithin(srgb, kThumbnailPx), a.name, a.source, false});
  }
  context.WriteOutput(artifact::kAugmentationSheet, EncodeJpeg(DrawContactSheet(sheet), 85));
}

void WriteResults(const KeyPicture& key, const Outcome& outcome, StageContext& context) {
  ordered_json samples = ordered_json::array();
  for (const Augmentation& a : outcome.made) {
    const std::string stem = artifact::kAugmentations + a.name;
    const Image& lab = a.picture.lab;
    context.WriteOutput(stem + ".png", EncodePng16(SrgbFromLab(lab)));
    context.WriteOutput(stem + ".ab.png", EncodeAbPng(ChromaOfLab(lab)));
    context.WriteOutput(stem + ".weight.png", EncodePng8(a.picture.weight));
    double weight = 0.0;
    for (const float w : a.picture.weight.data) weight += w;
    samples.push_back({{"name", a.name},
                       {"kind", a.kind},
                       {"source", a.source},
                       {"width", lab.width},
                       {"height", lab.height},
                       {"mean_weight", weight / static_cast<double>(lab.PlaneSize())}});
  }
  context.WriteOutput(
      artifact::kAugmentationFacts,
      ordered_json{{"samples", samples}, {"left_out", outcome.left_out}}.dump(1) + "\n");
  if (!outcome.made.empty()) WriteSheet(key, outcome, context);
}

}  // namespace

void AugmentationOptions::Validate() const {
  RangeCheck("augmentation option")("samples", samples, 0, kMaxSamples);
  CheckMaxSide(max_side_px);
}

void RunGenerateAugmentations(const AugmentationOptions& options, StageContext& context) {
  options.Validate();
  const Scene scene = ReadScene(context);
  const int key_index = ReadKeyView(context, scene);
  Outcome outcome;
  if (options.files) {
    outcome.made = AugmentationsFromFiles(options.max_side_px, context);
    if (outcome.made.empty()) {
      throw InvalidArgument(
          "the option `files` is set, but the scene has no pictures in augment/; add some or "
          "omit the option");
    }
  }
  const KeyPicture key = ReadKeyPicture(scene, key_index, options.max_side_px, context);
  std::map<Kind, int> counts = CountByKind(options);
  SkipNeedless(options, context, &counts, &outcome);
  if (!scene.views[key_index].mask_file.empty()) SkipMasked(&counts, &outcome);
  if (!options.backend.empty() && !counts.empty()) {
    const int side = std::max(options.max_side_px, kRemoteSidePx);
    const Image key_srgb = SrgbFromLab(KeyLab(scene, key_index, side, context));
    GenerateWithBackend(options, key_srgb, context, &counts, &outcome);
  }
  if (!counts.empty()) {
    const Surrogates surrogates(key,
                                scene,
                                key_index,
                                RendererFrom(scene.views[key_index].time_s(), context),
                                context.seed(),
                                context.cancel());
    MakeSurrogates(counts, surrogates, context, &outcome);
  }
  WriteResults(key, outcome, context);
}

}  // namespace color3d
