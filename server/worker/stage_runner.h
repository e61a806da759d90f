// Interface of the method library to the worker loop (leases, blobs, heartbeats): the loop prepares
// files, the runner runs the stage of the spec and writes its results to files. Only server/worker
// links the method library.
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

// Files of the blobs that a spec names (key colour, truth), by digest.
class BlobSource {
 public:
  virtual ~BlobSource() = default;
  // Returns a read-only file with these bytes, valid while the stage runs. Throws Error{kNotFound}.
  virtual std::filesystem::path Fetch(const std::string& sha256) = 0;
};

struct StageRun {
  std::string job_name;     // "jobs/..."
  std::string traceparent;  // W3C traceparent for calls of the stage; empty: none
  std::string project;      // project of the job; scenes of a batch take turns by project
  v1::JobSpec spec;
  std::filesystem::path scene_folder;  // the scene's files under their manifest paths, read-only
  // Artifacts of the input jobs by artifact name (read-only files).
  std::map<std::string, std::filesystem::path> inputs;
  std::filesystem::path output_folder;   // initially empty; files here may be published
  std::filesystem::path scratch_folder;  // initially empty; deleted afterwards
  std::filesystem::path cache_folder;    // shared by all jobs of the server; empty: none
  std::vector<StageSummary> graph;       // root job only: its children
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
  // Runs one attempt. Throws Error; other exceptions are internal errors. Called concurrently for
  // jobs of batch stages.
  virtual StageOutput Run(const StageRun& run,
                          BlobSource& blobs,
                          CheckpointStore& checkpoints,
                          ProgressObserver& progress,
                          const CancellationToken& cancel) = 0;
};

// Implemented in stage_runner.cc for all stages of core/stage.
std::unique_ptr<StageRunner> MakeStageRunner();

}  // namespace color3d
