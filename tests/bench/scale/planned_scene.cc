#include "tests/bench/scale/planned_scene.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/catalogue/stages.h"
#include "server/planning/job_plan.h"
#include "server/planning/job_spec.h"
#include "server/planning/planner.h"

namespace color3d {
namespace {

// Results of a stage: bytes and files of a scene and of each of its photos, key pictures in sizes
// of a photo file, and bytes of a checkpoint. Measured on 16 photos of 12 megapixels with preset
// fast (500 px, 35,000 Gaussians), checkpoints on 16 and 20 photos; stages that ended before their
// first checkpoint have none.
struct StageBytes {
  const char* kind;
  double fixed = 0.0;
  double per_photo = 0.0;
  double key_pictures = 0.0;
  int fixed_files = 0;
  double files_per_photo = 0.0;
  double checkpoint = 0.0;
};

constexpr StageBytes kStageBytes[] = {
    {kind::kImportScene, 0.4e6, 0.0, 0.0, 3, 0.0, 0.0},
    {kind::kSelectKeyView, 0.4e6, 0.0, 1.0, 3, 0.0, 0.0},
    {kind::kColorizeKeyView, 0.0, 0.0, 10.8, 3, 0.0, 0.0},
    {kind::kReconstructGeometry, 3.2e6, 0.0, 0.0, 3, 0.0, 10e6},
    {kind::kCarryColor, 0.0, 0.4e6, 0.0, 0, 1.0, 13e6},
    {kind::kPersonalize, 5.4e6, 0.0, 0.0, 2, 0.0, 29e6},
    {kind::kColorizeViews, 0.0, 0.53e6, 0.0, 0, 1.75, 0.0},
    {kind::kSolveChroma, 3.7e6, 0.0, 0.0, 2, 0.0, 0.0},
    {kind::kExport, 9.8e6, 0.0, 0.0, 5, 0.0, 0.0},
    {kind::kRender, 0.0, 0.03e6, 0.0, 0, 0.125, 0.0},
    {kind::kEvaluate, 0.2e6, 0.0, 0.0, 6, 0.0, 0.0},
    // Its other files are results of the stages before.
    {kind::kColorizeScene, 1e4, 0.0, 0.0, 17, 0.0, 0.0},
};

void SetBytes(const CaptureSize& capture, SimulatedStage* stage) {
  const auto found = std::ranges::find(
      kStageBytes, stage->kind, [](const StageBytes& row) { return std::string_view(row.kind); });
  if (found == std::end(kStageBytes)) return;
  stage->output_bytes = static_cast<int64_t>(found->fixed + found->per_photo * capture.photos +
                                             found->key_pictures * capture.photo_bytes);
  stage->output_files =
      found->fixed_files + static_cast<int>(found->files_per_photo * capture.photos);
  stage->checkpoint_bytes = static_cast<int64_t>(found->checkpoint);
}

}  // namespace

SimulatedScene PlannedScene(const CaptureSize& capture) {
  if (capture.photos < 2 || capture.photos > 100'000 || !(capture.photo_bytes >= 0.0)) {
    throw InvalidArgument("a capture has 2 to 100,000 photos of 0 bytes or more");
  }
  v1::JobSpec spec;
  spec.set_scene("scenes/simulated");
  v1::Digest& key_color = *spec.mutable_colorize_scene()->mutable_key_color()->mutable_image();
  key_color.set_sha256(Sha256Hex("key"));
  key_color.set_size_bytes(1'000'000);
  const SceneFacts facts = {
      .pictures = capture.photos,
      .layout = capture.has_poses ? CaptureLayout::kColmap : CaptureLayout::kPhotos};
  const NewGraph graph = PlanJob(spec, {}, facts);
  const v1::JobPlan plan =
      DescribeGraph(graph, facts, spec.colorize_scene().import_scene(), MachineFactor());
  SimulatedScene scene;
  scene.bytes = static_cast<int64_t>(capture.photo_bytes * capture.photos);
  scene.files = capture.photos;
  std::vector<int> places(graph.jobs.size(), -1);  // of the jobs that run
  int planned = 0;
  for (size_t i = 0; i < graph.jobs.size(); ++i) {
    const NewJob& job = graph.jobs[i];
    SimulatedStage stage;
    stage.kind = job.kind;
    // The plan describes all jobs but the submitted one, the last.
    if (i + 1 < graph.jobs.size()) stage.seconds = plan.stages(planned++).expected_seconds();
    if (!job.skip_reason.empty()) continue;
    for (const int input : job.inputs) {
      const int place = places[static_cast<size_t>(input)];
      if (place >= 0) stage.inputs.push_back(place);
    }
    const Stage* known = FindStage(job.kind);
    stage.resumes = known != nullptr && known->resumes;
    SetBytes(capture, &stage);
    places[i] = static_cast<int>(scene.stages.size());
    scene.stages.push_back(std::move(stage));
  }
  return scene;
}

}  // namespace color3d
