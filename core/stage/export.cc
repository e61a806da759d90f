#include "core/splat/export/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "core/base/range_check.h"
#include "core/splat/export/glb/glb.h"
#include "core/splat/export/motion/playable_scene.h"
#include "core/splat/export/rgb_refine.h"
#include "core/splat/export/sog/sog.h"
#include "core/splat/export/splat4d/splat4d.h"
#include "core/splat/export/spz/spz.h"
#include "core/splat/motion/geometry_in_time.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "core/stage/write_view_page.h"
#include "core/view/view_page.h"

namespace color3d {
namespace {

constexpr int kSidePx = 500;      // longer side of the renders that colours are refined on
constexpr size_t kMaxViews = 32;  // number of these renders, evenly spread

std::vector<RgbView> ViewsToCompare(const Scene& scene, std::vector<std::string>* names) {
  std::vector<RgbView> views;
  const size_t count = scene.views.size();
  const size_t wanted = std::min(count, kMaxViews);
  for (size_t i = 0; i < wanted; ++i) {
    const View& view = scene.views[i * count / wanted];
    views.push_back(
        {view.camera.FitWithin(kSidePx), view.cam_from_world, !view.held_out, view.time_s()});
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

// Writes the formats one by one. Data that several formats need is computed once.
class Exporter {
 public:
  Exporter(const ExportOptions& options, const Scene& scene, StageContext& context)
      : options_(options),
        scene_(scene),
        context_(context),
        in_time_(ParseGaussians(context.ReadInput(artifact::kModel))),
        shown_(context.HasInput(artifact::kKeyView) ? ReadKeyView(context, scene) : 0),
        model_(ModelAt(in_time_, scene.views.at(shown_).time_s(), context.pool())),
        frame_(ExportFrameOf(scene)),
        with_confidence_(options.confidence && !model_.confidence.empty()),
        views_(ViewsToCompare(scene, &view_names_)) {
    if (options.confidence && !with_confidence_) {
      context_.Warn("the model has no provenance: {} has no confidence", artifact::kPly);
    }
    if (!frame_.left_out.isZero(0.0)) {
      context_.Warn(
          "the scene lies too far from the origin for 32-bit positions: they are relative to the "
          "offset in the header of {}",
          artifact::kPly);
    }
  }

  void Run() {
    for (const ExportFormatInfo& info : kExportFormats) {
      if (!options_.formats.contains(info.format)) continue;
      context_.ThrowIfCancelled();
      if (!info.needs_motion || in_time_.IsDynamic()) {
        Write(info.format);
      } else if (info.by_default == ExportDefault::kOff || options_.formats.size() == 1) {
        context_.Warn("nothing moves in this scene: {} is not written", info.artifact);
      }
    }
    if (context_.HasInput(artifact::kKeyView)) {
      WritePage();
    }
    context_.WriteOutput(artifact::kExportScores, scores_.dump(1) + "\n");
  }

 private:
  void WritePage() {
    std::optional<PlayableScene> playable;
    if (IsPlayable(in_time_) && HasViewer() && !page_file_.name.empty()) {
      const GaussianModel seen = EverSeen(in_time_);
      const RgbRefinement rgb = Refine(seen, FitRgbHarmonics(seen, context_.pool()));
      scores_["page"] = ScoresOf(rgb, view_names_);
      playable = EncodePlayable(seen, rgb.harmonics, frame_, context_.pool());
    } else if (in_time_.IsDynamic() && HasViewer() && !page_file_.name.empty()) {
      context_.Warn(
          "the deformation of this scene is a field: in 3D {} shows the time of the key view, and "
          "its motion as a movie",
          artifact::kViewPage);
    }
    ViewPageContents contents{page_file_, playable ? &*playable : nullptr, {}};
    if (HasViewer() && !page_file_.name.empty()) {
      contents.movie = MakePageMovie(scene_, in_time_, context_);
    }
    WriteViewPage(scene_, shown_, model_, in_time_.IsDynamic(), std::move(contents), context_);
  }

  // The one list of writers.
  void Write(ExportFormat format) {
    switch (format) {
      case ExportFormat::kPly:
        return WriteForPage(
            artifact::kPly,
            EncodeGaussianPly(model_, Harmonics(), frame_, context_.pool(), with_confidence_));
      case ExportFormat::kSog:
        return WriteForPage(artifact::kSog, EncodeSog(Gaussians(), context_.pool()));
      case ExportFormat::kSpz:
        return WriteBytes(format,
                          EncodeSpz(Gaussians(),
                                    options_.spz_version == 2 ? SpzVersion::k2 : SpzVersion::k4,
                                    context_.pool()));
      case ExportFormat::kGlb:
        return WriteBytes(format, EncodeGlb(Gaussians()));
      case ExportFormat::kSplat:
        return WriteBytes(format, Splat());
      case ExportFormat::kSplat4d:
        return WriteBytes(format, Splat4d());
      case ExportFormat::kMoments:
        return WriteMoments();
    }
  }

  void WriteBytes(ExportFormat format, const std::string& bytes) {
    context_.WriteOutput(InfoOf(format).artifact, bytes);
  }

  // The view page shows the last of these files, which is the smaller one.
  void WriteForPage(const char* name, std::string bytes) {
    context_.WriteOutput(name, bytes);
    page_file_ = {name, std::move(bytes)};
  }

  RgbRefinement Refine(const GaussianModel& model, RgbHarmonics start) {
    RgbRefineOptions options;
    options.seed = context_.seed();
    return RefineRgbHarmonics(model, std::move(start), views_, options, context_.control());
  }

  const RgbHarmonics& Fitted() {
    if (!fitted_) fitted_ = FitRgbHarmonics(model_, context_.pool());
    return *fitted_;
  }

  // With view dependence, refined against our own renders.
  const RgbHarmonics& Harmonics() {
    if (!harmonics_) {
      RgbRefinement rgb = Refine(model_, Fitted());
      context_.progress().OnError(0, "ply_psnr_db", rgb.before.mean_psnr_db);
      context_.progress().OnError(RgbRefineOptions().epochs, "ply_psnr_db", rgb.after.mean_psnr_db);
      scores_["ply"] = ScoresOf(rgb, view_names_);
      harmonics_ = std::move(rgb.harmonics);
    }
    return *harmonics_;
  }

  const ViewerGaussians& Gaussians() {
    if (!gaussians_) gaussians_ = ForViewers(model_, Harmonics(), frame_, context_.pool());
    return *gaussians_;
  }

  std::string Splat() {
    const RgbRefinement rgb = Refine(model_, DegreeZero(Fitted()));
    scores_["splat"] = ScoresOf(rgb, view_names_);
    return EncodeSplat(model_, rgb.harmonics, frame_, context_.pool());
  }

  std::string Splat4d() {
    const int frames = std::min<int>(scene_.Times().size(), kMaxSplat4dFrames);
    const RgbHarmonics rgb = DegreeZero(FitRgbHarmonics(in_time_, context_.pool()));
    return EncodeSplat4d(in_time_, rgb, frame_, frames, context_.pool());
  }

  void WriteMoments() {
    const double span = in_time_.end_s() - in_time_.begin_s();
    for (int i = 0; i < options_.moments; ++i) {
      context_.ThrowIfCancelled();
      const double share =
          options_.moments > 1 ? static_cast<double>(i) / (options_.moments - 1) : 0.5;
      const GaussianModel at =
          ModelAt(in_time_, in_time_.begin_s() + share * span, context_.pool());
      context_.WriteOutput(
          fmt::format("{}{:05}.ply", artifact::kMoments, i + 1),
          EncodeGaussianPly(at, FitRgbHarmonics(at, context_.pool()), frame_, context_.pool()));
      context_.ReportProgress(i + 1, options_.moments, "writing moments");
    }
  }

  const ExportOptions& options_;
  const Scene& scene_;
  StageContext& context_;
  const GaussianModel in_time_;
  const int shown_;            // view; files of a single time show that of this view
  const GaussianModel model_;  // at this time
  const ExportFrame frame_;
  const bool with_confidence_;
  std::vector<std::string> view_names_;
  const std::vector<RgbView> views_;
  std::optional<RgbHarmonics> fitted_;
  std::optional<RgbHarmonics> harmonics_;
  std::optional<ViewerGaussians> gaussians_;
  ExportedFile page_file_;
  nlohmann::ordered_json scores_ = nlohmann::ordered_json::object();
};

}  // namespace

void ExportOptions::Validate() const {
  RangeCheck("export option")(
      "moments", moments, formats.contains(ExportFormat::kMoments) ? 1 : 0, 1000);
  if (formats.empty()) {
    throw InvalidArgument("the export has nothing to write; ask for {}", ExportFormatNames());
  }
  if (confidence && std::ranges::none_of(formats, [](ExportFormat format) {
        return InfoOf(format).carries_confidence;
      })) {
    throw InvalidArgument("only a PLY can carry confidence; ask for ply too");
  }
  if (spz_version != 2 && spz_version != 4) {
    throw InvalidArgument("there is no SPZ of version {} here; ask for 4 or 2", spz_version);
  }
}

void RunExport(const ExportOptions& options, StageContext& context) {
  options.Validate();
  const Scene scene = ReadScene(context);
  Exporter(options, scene, context).Run();
}

}  // namespace color3d
