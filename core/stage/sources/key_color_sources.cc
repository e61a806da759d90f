#include "core/stage/sources/key_color_sources.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/encoder/clip/clip.h"
#include "core/encoder/torch_threads.h"
#include "core/image/codec.h"
#include "core/image/reduced.h"
#include "core/keycolor/automatic/automatic.h"
#include "core/keycolor/external/remote.h"
#include "core/keycolor/external/script.h"
#include "core/keycolor/from_image.h"
#include "core/keycolor/hints/hint_layer.h"
#include "core/keycolor/recolor.h"
#include "core/keycolor/references/reference.h"
#include "core/keycolor/words/prompt.h"
#include "core/stage/context/stage_context.h"

namespace color3d {
namespace {

using nlohmann::ordered_json;
using Options = ColorizeKeyViewOptions;

constexpr int64_t kMaxPointsBytes = 1 << 26;
constexpr int kRegionsSidePx = 540;
// References are compared at a fraction of this size.
constexpr int kReferenceSidePx = 4096;

// Reads a mask from the luminance of any picture; white is 1.
Image ReadMask(const std::filesystem::path& file) {
  Image mask = LuminanceFromSrgb(ReadImage(file));
  for (float& value : mask.data) value /= 100.0f;
  return mask;
}

double MeanOf(const Image& plane) {
  return std::accumulate(plane.data.begin(), plane.data.end(), 0.0) /
         static_cast<double>(plane.data.size());
}

KeyColorResult FromImage(const Options& options, const KeyPhoto& photo, StageContext&) {
  PaintedColor color =
      KeyColorFromImage(photo.luminance, ReadImage(options.file, /*keep_alpha=*/true));
  KeyColorResult result;
  result.ab = std::move(color.ab);
  result.confidence = std::move(color.painted);
  if (!result.confidence.Empty()) result.facts = {{"painted", MeanOf(result.confidence)}};
  return result;
}

KeyColorResult FromHints(HintSolution solution) {
  return {std::move(solution.ab),
          {{"hinted_pixels", solution.hinted_pixels},
           {"iterations", solution.iterations},
           {"relative_residual", solution.relative_residual}}};
}

KeyColorResult FromStrokes(const Options& options, const KeyPhoto& photo, StageContext& context) {
  return FromHints(KeyColorFromStrokes(photo.luminance,
                                       ReadImage(options.file, /*keep_alpha=*/true),
                                       options.hints,
                                       context.control()));
}

KeyColorResult FromPoints(const Options& options, const KeyPhoto& photo, StageContext& context) {
  const auto hints = ParseHintsJson(ReadFile(options.file, kMaxPointsBytes));
  const Image labels = options.labels.empty() ? Image() : ReadStoredValues(options.labels);
  const bool asks_automatic = std::ranges::any_of(
      hints, [](const ColorHint& hint) { return hint.fill == ColorHint::Fill::kAutomatic; });
  const Image automatic =
      asks_automatic ? AutomaticColorizer::Embedded()->Colorize(photo.luminance).ab : Image();
  HintPictures pictures;
  if (!labels.Empty()) pictures.labels = &labels;
  if (asks_automatic) pictures.automatic_ab = &automatic;
  return FromHints(
      KeyColorFromHints(photo.luminance, hints, options.hints, context.control(), pictures));
}

KeyColorResult FromReferences(const Options& options,
                              const KeyPhoto& photo,
                              StageContext& context) {
  std::vector<Image> references;
  for (const std::filesystem::path& file : options.references) {
    references.push_back(ReadImageFitted(file, kReferenceSidePx));
  }
  const auto encoder = context.LoadEncoder(options.name);
  ReferenceOptions reference;
  reference.seed = static_cast<unsigned>(context.seed());
  ReferenceSolution solution =
      KeyColorFromReferences(photo.luminance, references, *encoder, reference, context.control());
  KeyColorResult result{std::move(solution.ab),
                        {{"description", encoder->description()},
                         {"explained", solution.explained},
                         {"mean_confidence", solution.mean_confidence},
                         {"iterations", solution.iterations},
                         {"relative_residual", solution.relative_residual}}};
  result.confidence = std::move(solution.confidence);
  return result;
}

KeyColorResult FromScript(const Options& options, const KeyPhoto& photo, StageContext& context) {
  context.ReportProgress(0, 1, "running the script " + options.name);
  ScriptColor color = KeyColorFromScript(photo.luminance, context.Model(options.name));
  return {std::move(color.ab),
          {{"script", options.name}, {"mean_luminance_difference", color.luminance_deviation}}};
}

KeyColorResult FromEdit(const Options& options, const KeyPhoto& photo, StageContext&) {
  const Image mask = options.mask.empty() ? Image() : ReadImage(options.mask);
  KeyColorResult result;
  result.ab =
      KeyColorFromEdit(photo.srgb, ReadImage(options.file), options.mask.empty() ? nullptr : &mask);
  result.facts = {{"masked", !options.mask.empty()}};
  return result;
}

KeyColorResult FromBackend(const Options& options, const KeyPhoto& photo, StageContext& context) {
  RemoteOptions remote;
  remote.name = options.name;
  remote.idempotency_key = context.attempt();
  remote.prompt = options.prompt;
  remote.seed = context.seed();
  if (!options.file.empty()) {
    remote.points = ParseHintsJson(ReadFile(options.file, kMaxPointsBytes));
  }
  if (!options.references.empty()) remote.reference = ReadImage(options.references[0]);
  if (!options.mask.empty()) remote.mask = ReadMask(options.mask);
  const auto backend = context.Remote(options.name);
  RemoteSolution solution =
      KeyColorFromRemote(photo.luminance, remote, *backend, context.progress(), context.cancel());
  const auto size = [](int width, int height) { return ordered_json{width, height}; };
  ordered_json facts{{"backend", options.name},
                     {"description", solution.info.description},
                     {"deterministic", solution.info.deterministic},
                     {"sent_px", size(solution.sent_width, solution.sent_height)},
                     {"answer_px", size(solution.answer_width, solution.answer_height)},
                     {"mean_luminance_difference", solution.mean_luminance_difference},
                     {"luminance_correlation", solution.luminance_correlation},
                     {"warnings", solution.warnings}};
  if (!options.prompt.empty()) facts["prompt"] = options.prompt;
  return {std::move(solution.ab), std::move(facts)};
}

KeyColorResult FromAutomatic(const Options& options, const KeyPhoto& photo, StageContext& context) {
  const auto colorizer = options.name.empty()
                             ? AutomaticColorizer::Embedded()
                             : AutomaticColorizer::FromWeightFile(context.Model(options.name));
  context.ThrowIfCancelled();
  context.ReportProgress(0, 1, "colouring the key view");
  AutomaticColor color = colorizer->Colorize(photo.luminance);
  KeyColorResult result{std::move(color.ab), {{"description", colorizer->description()}}};
  result.confidence = std::move(color.confidence);
  return result;
}

// Draws the regions that were found for each phrase in the phrase's colour.
Image DrawRegions(const Image& luminance, const std::vector<PromptRegion>& regions) {
  const Image l = FitWithin(luminance, kRegionsSidePx);
  Image ab(l.width, l.height, 2);
  for (const PromptRegion& region : regions) {
    if (!region.found) continue;
    const Image mask = Resize(region.mask, l.width, l.height);
    for (size_t i = 0; i < l.PlaneSize(); ++i) {
      ab.Plane(0)[i] += mask.data[i] * static_cast<float>(region.phrase.color.lab.a);
      ab.Plane(1)[i] += mask.data[i] * static_cast<float>(region.phrase.color.lab.b);
    }
  }
  return SrgbFromLab(JoinLab(l, ab));
}

ordered_json RegionFacts(const std::vector<PromptRegion>& regions) {
  ordered_json facts = ordered_json::array();
  for (const PromptRegion& region : regions) {
    facts.push_back({{"thing", region.phrase.thing},
                     {"color", region.phrase.color.name},
                     {"found", region.found},
                     {"share", region.share},
                     {"score", region.score}});
  }
  return facts;
}

KeyColorResult FromPrompt(const Options& options, const KeyPhoto& photo, StageContext& context) {
  const auto clip = ClipModel::FromWeightFile(context.Model(options.name));
  context.ThrowIfCancelled();
  // Regions of no phrase are coloured automatically.
  const Image rest = AutomaticColorizer::Embedded()->Colorize(photo.luminance).ab;
  PromptOptions prompt;
  prompt.hints = options.hints;
  PromptSolution solution =
      KeyColorFromPrompt(photo.luminance, options.prompt, *clip, rest, prompt, context.control());
  KeyColorResult result{std::move(solution.ab),
                        {{"description", clip->description()},
                         {"prompt", options.prompt},
                         {"regions", RegionFacts(solution.regions)},
                         {"hinted_pixels", solution.spread.hinted_pixels},
                         {"relative_residual", solution.spread.relative_residual},
                         {"warnings", solution.notes}}};
  result.confidence = std::move(solution.confidence);
  result.regions = DrawRegions(photo.luminance, solution.regions);
  return result;
}

// Lays the points of the options above the colours of the source.
void LayPointsAbove(const Options& options,
                    const KeyPhoto& photo,
                    StageContext& context,
                    KeyColorResult* result) {
  const auto hints = ParseHintsJson(ReadFile(options.above, kMaxPointsBytes));
  const Image labels = options.labels.empty() ? Image() : ReadStoredValues(options.labels);
  HintPictures pictures;
  if (!labels.Empty()) pictures.labels = &labels;
  const HintLayer layer =
      LayerOfHints(photo.luminance, result->ab, hints, {}, context.control(), pictures);
  LayAbove(layer, &result->ab);
  for (size_t i = 0; i < result->confidence.data.size(); ++i) {
    float& confidence = result->confidence.data[i];
    confidence += layer.share.data[i] * (1.0f - confidence);
  }
  result->facts["above"] = {{"hinted_pixels", layer.hinted_pixels},
                            {"share", MeanOf(layer.share)},
                            {"iterations", layer.iterations}};
}

struct SourceRow {
  Options::Source source;
  const char* name;
  KeyColorResult (*solve)(const Options&, const KeyPhoto&, StageContext&);
};
constexpr SourceRow kSources[] = {{Options::Source::kImage, "image", FromImage},
                                  {Options::Source::kStrokes, "strokes", FromStrokes},
                                  {Options::Source::kPoints, "points", FromPoints},
                                  {Options::Source::kReferences, "references", FromReferences},
                                  {Options::Source::kPrompt, "prompt", FromPrompt},
                                  {Options::Source::kAutomatic, "automatic", FromAutomatic},
                                  {Options::Source::kBackend, "backend", FromBackend},
                                  {Options::Source::kScript, "script", FromScript},
                                  {Options::Source::kEdit, "edit", FromEdit}};

const SourceRow& Find(Options::Source source) {
  const auto* found = std::ranges::find(kSources, source, &SourceRow::source);
  if (found == std::end(kSources)) {
    throw Error(ErrorCode::kInternal, "a source of key colour is missing in the table");
  }
  return *found;
}

}  // namespace

const char* KeyColorSourceName(ColorizeKeyViewOptions::Source source) { return Find(source).name; }

KeyColorResult SolveKeyColor(const ColorizeKeyViewOptions& options,
                             const KeyPhoto& photo,
                             StageContext& context) {
  SetTorchThreads(context.pool().thread_count(), /*blas_threads=*/1);
  KeyColorResult result = Find(options.source).solve(options, photo, context);
  if (!options.above.empty()) LayPointsAbove(options, photo, context, &result);
  return result;
}

}  // namespace color3d
