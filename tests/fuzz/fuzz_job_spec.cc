// Fuzz target: CreateJob requests, their checks and planned graphs.
#include "core/catalogue/stages.h"
#include "server/planning/job_spec.h"
#include "server/planning/plan_scenes.h"
#include "server/planning/planner.h"
#include "server/planning/spec_check.h"
#include "server/planning/spec_names.h"
#include "server/planning/stage_key.h"
#include "server/rpc/calls/convert.h"
#include "tests/fuzz/request_checks.h"

namespace color3d {
namespace {

constexpr char kScene[] = "scenes/a";
constexpr SceneFacts kFacts[] = {{.pictures = 20, .layout = CaptureLayout::kColmap},
                                 {.pictures = 2, .augment_files = 3},
                                 {.pictures = 90, .layout = CaptureLayout::kFilm},
                                 {.layout = CaptureLayout::kSplat}};

// A job of each kind that other jobs read.
std::vector<JobRecord> InputsOf(const std::string& scene) {
  std::vector<JobRecord> inputs;
  for (const char* kind : {kind::kImportScene,
                           kind::kSelectKeyView,
                           kind::kColorizeKeyView,
                           kind::kPersonalize,
                           kind::kReconstructGeometry}) {
    JobRecord job;
    job.id = static_cast<int64_t>(inputs.size()) + 1;
    job.name = "jobs/" + std::string(kind);
    job.kind = kind;
    job.scene = scene;
    job.state = JobState::kSucceeded;
    v1::JobSpec spec;
    spec.set_scene(scene);
    MutableStage(&spec, kind);
    job.spec = spec.SerializeAsString();
    inputs.push_back(std::move(job));
  }
  return inputs;
}

void CheckGraph(const v1::JobSpec& spec, const NewGraph& graph) {
  if (graph.jobs.empty() || graph.jobs.back().kind != KindOf(spec)) std::abort();
  for (size_t i = 0; i < graph.jobs.size(); ++i) {
    const NewJob& job = graph.jobs[i];
    const v1::JobSpec planned = ParseSpec(job.spec, "jobs/planned");
    if (KindOf(planned) != job.kind) std::abort();
    KeyPartOf(planned);
    for (const int input : job.inputs) {
      if (input < 0 || static_cast<size_t>(input) >= i) std::abort();
    }
    for (const std::string& blob : job.blobs) {
      if (!IsSha256Hex(blob)) std::abort();
    }
  }
}

NewGraph PlanOf(const v1::JobSpec& spec, const SceneFacts& facts) {
  if (!spec.has_personalize_scenes()) {
    return PlanJob(
        spec, spec.inputs().empty() ? std::vector<JobRecord>() : InputsOf(spec.scene()), facts);
  }
  std::vector<SceneRouteInputs> routes;
  for (const auto& route : spec.personalize_scenes().routes()) {
    routes.push_back({InputsOf(route.scene()), facts});
  }
  return PlanPersonalizeScenes(spec, routes);
}

v1::Digest SomeDigest() {
  v1::Digest digest;
  digest.set_sha256(Sha256Hex("key"));
  digest.set_size_bytes(3);
  return digest;
}

std::string RequestOf(const v1::JobSpec& spec) {
  v1::CreateJobRequest request;
  *request.mutable_spec() = spec;
  request.mutable_spec()->set_scene(kScene);
  request.set_priority(7);
  return request.SerializeAsString();
}

}  // namespace

std::vector<std::string> FuzzSeeds() {
  std::vector<std::string> seeds;
  for (const auto preset : {v1::PRESET_FAST, v1::PRESET_PAPER}) {
    v1::JobSpec spec;
    v1::ColorizeSceneSpec* scene = spec.mutable_colorize_scene();
    scene->set_preset(preset);
    *scene->mutable_key_color()->mutable_image() = SomeDigest();
    scene->set_time_budget_seconds(600);
    seeds.push_back(RequestOf(spec));
  }
  for (const char* kind : {kind::kImportScene,
                           kind::kSelectKeyView,
                           kind::kColorizeKeyView,
                           kind::kPersonalize,
                           kind::kColorizeViews,
                           kind::kCarryColor,
                           kind::kReconstructGeometry,
                           kind::kSolveChroma,
                           kind::kCorrectColors}) {
    v1::JobSpec spec;
    MutableStage(&spec, kind);
    spec.add_inputs("jobs/given");
    seeds.push_back(RequestOf(spec));
  }
  v1::JobSpec named;
  named.mutable_personalize()->set_encoder("mine");
  named.mutable_personalize()->set_iterations(7);
  named.add_inputs("jobs/given");
  seeds.push_back(RequestOf(named));
  v1::JobSpec scenes;
  scenes.mutable_personalize_scenes()->add_routes()->set_scene(kScene);
  scenes.mutable_personalize_scenes()->add_routes()->set_scene("scenes/b");
  seeds.push_back(RequestOf(scenes));
  return seeds;
}

}  // namespace color3d

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace color3d;
  v1::CreateJobRequest request;
  if (!ParseRequest(data, size, &request)) return 0;
  const UserModels models{{{"mine", "/weights"}}, {{"there", "127.0.0.1:1"}}};
  const v1::JobSpec& spec = request.spec();
  for (const SceneFacts& facts : kFacts) {
    AnswerOrRefuse(
        [&] {
          CheckName(spec.scene(), "scenes");
          CheckSpec(spec);
          CheckNames(spec, models);
          for (const FileDigest& blob : SpecBlobs(spec)) {
            if (!IsSha256Hex(blob.sha256) || blob.size_bytes < 0) std::abort();
          }
          CheckGraph(spec, PlanOf(spec, facts));
        },
        {grpc::StatusCode::FAILED_PRECONDITION, grpc::StatusCode::UNIMPLEMENTED});
  }
  return 0;
}
