#include "core/stage/chroma_bound.h"

#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/splat/chroma/chroma_fit.h"

namespace color3d {
namespace {

// The curves of this fit would stand among those of the scene's own chroma.
class WithoutCurves : public ProgressObserver {
 public:
  explicit WithoutCurves(ProgressObserver& outer) : outer_(outer) {}
  void OnProgress(int64_t step, int64_t total, const std::string& message) override {
    outer_.OnProgress(step, total, "bound: " + message);
  }
  void OnError(int64_t, const std::string&, double) override {}
  void OnWarning(const std::string& message) override { outer_.OnWarning("bound: " + message); }

 private:
  ProgressObserver& outer_;
};

}  // namespace

GaussianModel FitTrueChroma(const GaussianModel& geometry,
                            const Scene& scene,
                            const std::map<int, std::filesystem::path>& truth,
                            int max_side_px,
                            const ChromaOptions& options,
                            ThreadPool& pool,
                            StageContext& context) {
  for (const int view : scene.TrainingViews()) {
    if (truth.contains(view)) continue;
    throw InvalidArgument("the bound needs the true colours of every training view; those of " +
                          scene.views[view].name + " are missing");
  }
  const ViewImages images(scene, context.scene_folder(), max_side_px, 0);
  const ChromaTargetSource targets = [&](int view) {
    auto target = std::make_shared<ChromaTarget>();
    target->ab = ChromaOfLab(LabFromSrgb(images.Undistort(view, ReadImage(truth.at(view)))));
    return target;
  };
  WithoutCurves progress(context.progress());
  NoCheckpoints none;
  return FitChroma(geometry,
                   ChromaProblemOf(scene, images, targets),
                   options,
                   {pool, none, progress, context.cancel()});
}

}  // namespace color3d
