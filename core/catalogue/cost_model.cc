#include "core/catalogue/cost_model.h"

#include <algorithm>

#include "core/catalogue/estimates.h"
#include "core/catalogue/kind_row.h"
#include "core/catalogue/stages.h"

namespace color3d {
namespace {

// Fitted to the stage seconds of fern, fox, banana, sceaux and lady_running (film) with the preset
// fast; those of several cameras to athlete4cam, earlier. JobPlanTest.AgreesWithMeasuredRuns
// compares them.

// Seconds that depend on the kind of capture.
struct KindCosts {
  CaptureKind kind;
  double import;    // one view, without poses
  double geometry;  // times the training of a static scene
  // One megapixel of one view.
  double carry;
  double color;
  double chroma;
  double evaluate;
  double render;  // one view
};

// Geometry and chroma of films, which are left out, are those of dynamic scenes: what that saves.
constexpr KindCosts kKindCosts[] = {{CaptureKind::kStatic, 0.0, 1.0, 0.62, 1.15, 0.58, 0.5, 0.005},
                                    {CaptureKind::kFilm, 0.011, 2.8, 0.43, 1.28, 3.0, 0.32, 0.03},
                                    {CaptureKind::kDynamic, 0.011, 2.8, 1.1, 1.95, 3.0, 0.5, 0.07},
                                    {CaptureKind::kRelief, 0.011, 2.8, 1.1, 1.95, 3.0, 0.5, 0.07},
                                    {CaptureKind::kPictures, 0.0, 1.0, 4.0, 1.95, 0.75, 0.32, 0.1}};

// One iteration of training the geometry of a static scene.
constexpr double kIterationSeconds = 0.0008;
constexpr double kIterationSecondsPerGaussian = 4.1e-8;
constexpr double kIterationSecondsPerMegapixel = 0.025;
constexpr double kThreeChannels = 1.5;  // times one channel: 16.6 against 11.1 ms an iteration

// Personalization: features and neighbours, then iterations of the decoder.
constexpr double kPersonalizeSeconds = 2.2;
constexpr double kDecoderIterationSeconds = 0.05;
constexpr double kPaperIterationSeconds = 0.22;  // 4000 in 883 s
constexpr int kIterationsBeforeEarlyEnd = 300;

constexpr double kSelectSecondsPerMegapixel = 0.33;  // 323 photographs in 20 s
constexpr double kKeyColorSeconds = 0.3;
constexpr double kExportSecondsPerGaussian = 7e-5;

const KindCosts& CostsOf(CaptureKind kind) { return RowOfKind(kKindCosts, kind, "costs"); }

double GeometrySeconds(const StageWork& work) {
  if (work.geometry_given) return 0.0;
  const double iteration = kIterationSeconds + kIterationSecondsPerGaussian * work.gaussians +
                           kIterationSecondsPerMegapixel * work.megapixels;
  return work.iterations * iteration * CostsOf(work.kind).geometry;
}

double PersonalizeSeconds(const StageWork& work) {
  if (work.paper_recipe) return kPaperIterationSeconds * work.iterations;
  const int iterations =
      work.ends_early ? std::min(work.iterations, kIterationsBeforeEarlyEnd) : work.iterations;
  return kPersonalizeSeconds + kDecoderIterationSeconds * iterations;
}

}  // namespace

double AssumedMegapixels(int max_side_px, bool is_frame) {
  constexpr double kPhotoAspect = 3.0 / 4.0, kFrameAspect = 9.0 / 16.0;
  return 1e-6 * max_side_px * max_side_px * (is_frame ? kFrameAspect : kPhotoAspect);
}

double EstimateSeconds(std::string_view stage, const StageWork& work) {
  StageOf(stage);  // throws if it is unknown
  const KindCosts& costs = CostsOf(work.kind);
  const double megapixels = work.views * work.megapixels;
  if (stage == kind::kImportScene) {
    return (costs.import + (work.estimates_poses ? kPosesSecondsPerPhoto : 0.0)) * work.views;
  }
  if (stage == kind::kSelectKeyView) {
    return work.key_view_given ? 0.0 : kSelectSecondsPerMegapixel * megapixels;
  }
  if (stage == kind::kColorizeKeyView) return kKeyColorSeconds;
  if (stage == kind::kReconstructGeometry) return GeometrySeconds(work);
  if (stage == kind::kCarryColor) return costs.carry * megapixels;
  if (stage == kind::kPersonalize) return PersonalizeSeconds(work);
  if (stage == kind::kColorizeViews) return costs.color * megapixels;
  if (stage == kind::kSolveChroma) {
    return work.trains_jointly ? kThreeChannels * GeometrySeconds(work) : costs.chroma * megapixels;
  }
  if (stage == kind::kExport) return kExportSecondsPerGaussian * work.gaussians;
  if (stage == kind::kRender) return costs.render * work.views;
  if (stage == kind::kEvaluate) return costs.evaluate * megapixels;
  // Not measured: generated pictures and corrections. No work of their own: composite kinds.
  return 0.0;
}

}  // namespace color3d
