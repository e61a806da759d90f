#include "core/splat/export/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/base/range_check.h"
#include "core/splat/export/glb/glb.h"
#include "core/splat/export/rgb_refine.h"
#include "core/splat/export/sog/sog.h"
#include "core/splat/export/splat4d/splat4d.h"
#include "core/splat/export/spz/spz.h"
#include "core/splat/motion/motion.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "core/stage/write_view_page.h"

namespace color3d {
namespace {

constexpr int kSidePx = 500;      // of the pictures that colours are refined on
constexpr size_t kMaxViews = 32;  // of them, spread evenly

std::vector<RgbView> ViewsToCompare(const Scene& scene, std::vector<std::string>* names) {
  std::vector<RgbView> views;
  const size_t count = scene.views.size();
  const size_t wanted = std::min(count, kMaxViews);
  for (size_t i = 0; i < wanted; ++i) {
    const View& view = scene.views[i * count / wanted];
    views.push_back({view.camera.FitWithin(kSidePx), view.cam_from_world, !view.held_out});
    names->push_back(view.name);
  }
  return views;
}

nlohmann::ordered_json ScoresOf(const RgbRefinement& refinement,
                                const std::vector<std::string>& names) {
  return {{"psnr_db_vs_lab", refinement.after.mean_psnr_db},
          {"worst_psnr_db_vs_lab", refinement.after.worst_psnr_db},
          {"worst_view", names.at(refinement.after.worst_view)},
          {"unrefined_psnr_db_vs_lab", refinement.before.mean_psnr_db},
          {"unrefined_worst_psnr_db_vs_lab", refinement.before.worst_psnr_db}};
}

// Returns the smaller of the files that browsers show.
ExportedFile WriteWithHarmonics(const ExportOptions& options,
                                const GaussianModel& model,
                                const RgbHarmonics& rgb,
                                const ExportFrame& frame,
                                bool with_confidence,
                                StageContext& context) {
  ExportedFile smaller;
  if (options.ply) {
    smaller = {artifact::kPly,
               EncodeGaussianPly(model, rgb, frame, context.pool(), with_confidence)};
    context.WriteOutput(smaller.name, smaller.bytes);
  }
  if (!options.sog && !options.spz && !options.glb) return smaller;
  const ViewerGaussians gaussians = ForViewers(model, rgb, frame, context.pool());
  if (options.sog) {
    smaller = {artifact::kSog, EncodeSog(gaussians, context.pool())};
    context.WriteOutput(smaller.name, smaller.bytes);
  }
  if (options.spz) {
    const SpzVersion version = options.spz_version == 2 ? SpzVersion::k2 : SpzVersion::k4;
    context.WriteOutput(artifact::kSpz, EncodeSpz(gaussians, version, context.pool()));
  }
  if (options.glb) context.WriteOutput(artifact::kGlb, EncodeGlb(gaussians));
  return smaller;
}

void WriteMoments(const ExportOptions& options,
                  const GaussianModel& model,
                  const ExportFrame& frame,
                  StageContext& context) {
  if (options.moments == 0) return;
  if (model.motion.size() == 0) {
    context.progress().OnWarning("nothing moves in this scene: there are no moments to export");
    return;
  }
  const double span = model.motion.end_s - model.motion.begin_s;
  for (int i = 0; i < options.moments; ++i) {
    context.cancel().ThrowIfCancelled();
    const double share = options.moments > 1 ? static_cast<double>(i) / (options.moments - 1) : 0.5;
    const GaussianModel at = ModelAt(model, model.motion.begin_s + share * span, context.pool());
    context.WriteOutput(
        fmt::format("{}{:05}.ply", artifact::kMoments, i + 1),
        EncodeGaussianPly(at, FitRgbHarmonics(at, context.pool()), frame, context.pool()));
    context.progress().OnProgress(i + 1, options.moments, "writing moments");
  }
}

}  // namespace

void ExportOptions::Validate() const {
  RangeCheck("export option")("moments", moments, 0, 1000);
  if (!ply && !sog && !spz && !glb && !splat) {
    throw InvalidArgument("the export has nothing to write; ask for ply, sog, spz, glb or splat");
  }
  if (confidence && !ply) {
    throw InvalidArgument("only a PLY can carry confidence; ask for ply too");
  }
  if (spz_version != 2 && spz_version != 4) {
    throw InvalidArgument("there is no SPZ of version {} here; ask for 4 or 2", spz_version);
  }
}

void RunExport(const ExportOptions& options, StageContext& context) {
  options.Validate();
  const Scene scene = ReadScene(context);
  if (scene.IsFilm()) {  // nothing was reconstructed
    context.WriteOutput(artifact::kExportScores, "{}\n");
    return;
  }
  const GaussianModel in_time = ParseGaussians(context.ReadInput(artifact::kModel));
  const int shown = context.HasInput(artifact::kKeyView) ? ReadKeyView(context, scene) : 0;
  const GaussianModel model = ModelAt(in_time, scene.views.at(shown).time_s(), context.pool());
  const bool with_confidence = options.confidence && !model.confidence.empty();
  if (options.confidence && !with_confidence) {
    context.progress().OnWarning(
        fmt::format("the model does not know where its colours come from: {} has no confidence",
                    artifact::kPly));
  }
  const ExportFrame frame = ExportFrameOf(scene);
  if (!frame.left_out.isZero(0.0)) {
    context.progress().OnWarning(fmt::format(
        "the scene lies so far from the origin that the 32-bit numbers of its files cannot say "
        "where: positions are relative to the offset in the header of {}",
        artifact::kPly));
  }
  std::vector<std::string> names;
  const std::vector<RgbView> views = ViewsToCompare(scene, &names);
  RgbRefineOptions refine;
  refine.seed = context.seed();
  const auto refined = [&](RgbHarmonics start) {
    return RefineRgbHarmonics(model, std::move(start), views, refine, context.control());
  };
  const RgbHarmonics fitted = FitRgbHarmonics(model, context.pool());
  nlohmann::ordered_json scores;
  if (options.ply || options.sog || options.spz || options.glb) {
    const RgbRefinement rgb = refined(fitted);
    context.progress().OnError(0, "ply_psnr_db", rgb.before.mean_psnr_db);
    context.progress().OnError(refine.epochs, "ply_psnr_db", rgb.after.mean_psnr_db);
    scores["ply"] = ScoresOf(rgb, names);
    const ExportedFile file =
        WriteWithHarmonics(options, model, rgb.harmonics, frame, with_confidence, context);
    if (context.HasInput(artifact::kKeyView)) {
      WriteViewPage(scene, shown, model, in_time.motion.size() > 0, file, context);
    }
  }
  if (options.splat) {
    const RgbRefinement rgb = refined(DegreeZero(fitted));
    scores["splat"] = ScoresOf(rgb, names);
    context.WriteOutput(artifact::kSplat, EncodeSplat(model, rgb.harmonics, frame, context.pool()));
  }
  if (options.splat4d && in_time.motion.size() > 0) {
    const int frames = std::min<int>(scene.Times().size(), kMaxSplat4dFrames);
    const RgbHarmonics rgb = DegreeZero(FitRgbHarmonics(in_time, context.pool()));
    context.WriteOutput(artifact::kSplat4d,
                        EncodeSplat4d(in_time, rgb, frame, frames, context.pool()));
  }
  WriteMoments(options, in_time, frame, context);
  context.WriteOutput(artifact::kExportScores, scores.dump(1) + "\n");
}

}  // namespace color3d
