// What the worker loop (leases, blobs, heartbeats) asks of the method library: the loop prepares
// files, the runner turns the job's spec into one core stage and leaves its results as files. The
// only folder of the server that links the method library is server/worker.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "color3d/v1/job.pb.h"
#include "core/base/cancellation.h"
#include "core/base/progress.h"
#include "core/catalogue/stage_summary.h"
#include "server/store/user_models.h"

namespace color3d {

// Files by digest, for blobs that a spec names (key colour, truth).
class BlobSource {
 public:
  virtual ~BlobSource() = default;
  // A read-only file with these bytes; valid while the stage runs. Throws Error{kNotFound}.
  virtual std::filesystem::path Fetch(const std::string& sha256) = 0;
};

struct StageRun {
  std::string job_name;  // "jobs/..."
  std::string trace;     // W3C trace id of the call that made the job; empty: none
  std::string project;   // of the job's owner; scenes in a batch take turns by project
  v1::JobSpec spec;
  std::filesystem::path scene_folder;  // the scene's files under their manifest paths, read-only
  // Artifacts of the jobs that this one depends on, by artifact name (read-only files).
  std::map<std::string, std::filesystem::path> inputs;
  std::filesystem::path output_folder;   // empty; what the runner leaves here may be published
  std::filesystem::path scratch_folder;  // empty; deleted afterwards
  std::filesystem::path cache_folder;    // shared by all jobs of the server; empty: none
  std::vector<StageSummary> graph;       // the root job only: its children
  int threads = 1;
  int attempt = 1;
  UserModels models;
};

struct StageOutput {
  std::vector<std::string> files;      // relative paths below output_folder = artifact names
  std::vector<std::string> passed_on;  // names of `inputs` to publish again under the same name
};

class StageRunner {
 public:
  virtual ~StageRunner() = default;
  // Runs one attempt. Throws Error; anything else that escapes is an internal error of ours. Called
  // from several threads at once for jobs of stages that run in batch.
  virtual StageOutput Run(const StageRun& run,
                          BlobSource& blobs,
                          CheckpointStore& checkpoints,
                          ProgressObserver& progress,
                          const CancellationToken& cancel) = 0;
};

// The real one (stage_runner.cc): every stage of core/stage.
std::unique_ptr<StageRunner> MakeStageRunner();

}  // namespace color3d
