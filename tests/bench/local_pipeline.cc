#include "tests/bench/local_pipeline.h"

#include <fmt/format.h>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/catalogue/stages.h"
#include "core/report/curves.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/idle_stages.h"

namespace color3d {
namespace {

// Prints errors and warnings, and keeps the warnings.
class PrintingObserver : public ProgressObserver {
 public:
  PrintingObserver(std::string kind, const std::function<void(const std::string&)>& say)
      : kind_(std::move(kind)), say_(say) {}

  void OnProgress(int64_t, int64_t, const std::string&) override {}
  void OnError(int64_t iteration, const std::string& name, double value) override {
    Say(fmt::format("{} {}: {} {}", kind_, iteration, name, value));
  }
  void OnWarning(const std::string& message) override {
    warnings.push_back(message);
    Say(kind_ + ": " + message);
  }

  std::vector<std::string> warnings;

 private:
  void Say(const std::string& text) {
    if (say_) say_(text);
  }
  std::string kind_;
  const std::function<void(const std::string&)>& say_;
};

}  // namespace

LocalPipeline::LocalPipeline(std::filesystem::path scene_folder,
                             std::filesystem::path out_folder,
                             int threads,
                             uint64_t seed,
                             std::function<void(const std::string&)> say)
    : scene_folder_(std::move(scene_folder)),
      out_folder_(std::move(out_folder)),
      threads_(threads),
      seed_(seed),
      say_(std::move(say)) {
  std::filesystem::create_directories(out_folder_);
}

void LocalPipeline::ImportScene() {
  Run(kind::kImportScene, [&](StageContext& context) {
    ImportOptions options;
    options.hold_out_every_eighth = true;
    RunImportScene(options, context);
  });
}

void LocalPipeline::SelectKeyView(const std::string& view) {
  Run(kind::kSelectKeyView, [&](StageContext& context) {
    SelectKeyViewOptions options;
    options.view = view;
    if (!view.empty()) options.selection.strategy = KeyViewStrategy::kManual;
    RunSelectKeyView(options, context);
  });
}

std::filesystem::path LocalPipeline::ArtifactPath(const std::string& name) const {
  const auto found = artifacts_.find(name);
  if (found == artifacts_.end()) {
    throw InvalidArgument("there is no {}; --earlier takes the folder of a run of all stages",
                          name);
  }
  return found->second;
}

void LocalPipeline::TakeAll() {
  for (const std::string& name : ListFiles(out_folder_)) Take(name, out_folder_ / name);
}

void LocalPipeline::Run(const std::string& kind,
                        const std::function<void(StageContext&)>& stage,
                        const std::string& folder) {
  NoCheckpoints none;
  PrintingObserver observer(kind, say_);
  CurveRecorder recorder(kind, observer, none);
  CancellationToken cancel;
  const ScratchFolder scratch;
  StageContext context({.scene_folder = scene_folder_,
                        .inputs = artifacts_,
                        .output_folder = out_folder_ / folder,
                        .scratch_folder = scratch.path(),
                        .threads = threads_,
                        .seed = seed_},
                       recorder,
                       recorder,
                       cancel);
  if (SkipIdleStage(kind, context).empty()) stage(context);
  const double seconds = recorder.Seconds();
  if (!recorder.points().empty()) {
    context.WriteOutput(artifact::kCurves + kind + ".csv", CurvesToCsv(recorder.points()));
  }
  for (const std::string& name : context.outputs())
    artifacts_[folder + name] = out_folder_ / folder / name;
  summaries_.push_back(
      {.kind = kind, .state = "SUCCEEDED", .seconds = seconds, .warnings = observer.warnings});
  if (say_) say_(fmt::format("{} took {:.1f} s", kind, seconds));
}

}  // namespace color3d
