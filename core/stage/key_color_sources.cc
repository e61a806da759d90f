#include "core/stage/key_color_sources.h"

#include <algorithm>

#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/keycolor/remote.h"

namespace color3d {
namespace {

using nlohmann::ordered_json;
using Options = ColorizeKeyViewOptions;

constexpr int64_t kMaxPointsBytes = 1 << 26;

// White is 1: any grey or colour picture, by its luminance.
Image ReadMask(const std::filesystem::path& file) {
  Image mask = LuminanceFromSrgb(ReadImage(file));
  for (float& value : mask.data) value /= 100.0f;
  return mask;
}

KeyColorResult FromImage(const Options& options, const KeyPhoto& photo, StageContext&) {
  return {KeyColorFromImage(photo.luminance, ReadImage(options.file)), {}};
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
                                       context.progress(),
                                       context.cancel()));
}

KeyColorResult FromPoints(const Options& options, const KeyPhoto& photo, StageContext& context) {
  return FromHints(KeyColorFromHints(photo.luminance,
                                     ParseHintsJson(ReadFile(options.file, kMaxPointsBytes)),
                                     options.hints,
                                     context.progress(),
                                     context.cancel()));
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

[[noreturn]] KeyColorResult NotBuilt(const Options& options, const KeyPhoto&, StageContext&) {
  throw Error(ErrorCode::kUnimplemented,
              std::string("key colour by ") + KeyColorSourceName(options.source) +
                  " is not built yet; give an image, strokes or points");
}

struct Source {
  Options::Source source;
  const char* name;
  KeyColorResult (*solve)(const Options&, const KeyPhoto&, StageContext&);
};
constexpr Source kSources[] = {{Options::Source::kImage, "image", FromImage},
                               {Options::Source::kStrokes, "strokes", FromStrokes},
                               {Options::Source::kPoints, "points", FromPoints},
                               {Options::Source::kReferences, "references", NotBuilt},
                               {Options::Source::kPrompt, "prompt", NotBuilt},
                               {Options::Source::kAutomatic, "automatic", NotBuilt},
                               {Options::Source::kBackend, "backend", FromBackend},
                               {Options::Source::kScript, "script", NotBuilt},
                               {Options::Source::kEdit, "edit", NotBuilt}};

const Source& Find(Options::Source source) {
  const auto* found = std::find_if(std::begin(kSources),
                                   std::end(kSources),
                                   [&](const Source& entry) { return entry.source == source; });
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
  return Find(options.source).solve(options, photo, context);
}

}  // namespace color3d
