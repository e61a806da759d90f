// What every stage is given and leaves: files in, named files out. One source per stage beside this
// one, named as its kind: typed options in, artifacts out; threads, checkpoints, progress and
// cancellation come from the context.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/run_control.h"
#include "core/encoder/encoder.h"
#include "core/keycolor/external/remote.h"

namespace color3d {

class SceneBatch;

// Lives for one run of one stage, on one thread.
class StageContext {
 public:
  struct Setup {
    std::filesystem::path scene_folder;                   // the scene's files, read-only
    std::map<std::string, std::filesystem::path> inputs;  // artifacts of earlier stages by name
    std::filesystem::path output_folder;   // artifacts are left here under their names
    std::filesystem::path scratch_folder;  // free to use, deleted by the caller
    int threads = 1;
    uint64_t seed = 1;
    // That the stage may take. 0: 60 % of what the machine has left, and not more than 90 % of what
    // this process's own limit leaves.
    int64_t memory_bytes = 0;
    std::map<std::string, std::filesystem::path> models;  // the user's weights, by name
    RemoteColorizerFactory remote_colorizers;             // the user's model servers; may be empty
    std::string attempt;                                  // unique to this run, e.g. "jobs/3f/2"
    // Kept between jobs (FileCache); empty: none.
    std::filesystem::path cache_folder = {};
    SceneBatch* batch = nullptr;  // that personalization takes part in; null: alone
    std::string project = {};     // of the job's owner; scenes in the batch take turns by project
  };

  // The references must outlive the context.
  StageContext(Setup setup,
               CheckpointStore& checkpoints,
               ProgressObserver& progress,
               const CancellationToken& cancel);

  const std::filesystem::path& scene_folder() const { return setup_.scene_folder; }
  const std::filesystem::path& scratch_folder() const { return setup_.scratch_folder; }
  // The threads of this run, started when they are first asked for. For the calling thread.
  ThreadPool& pool();
  // What long computations are given.
  RunControl control() { return {pool(), checkpoints_, progress_, cancel_}; }
  uint64_t seed() const { return setup_.seed; }
  int64_t MemoryBytes() const;
  const std::string& attempt() const { return setup_.attempt; }
  // File of the user's weights. Throws Error{kFailedPrecondition} naming those that there are.
  std::filesystem::path Model(const std::string& name) const;
  // A model server of the user's. Throws as Model.
  std::unique_ptr<RemoteColorizer> Remote(const std::string& name) const;
  // The encoder of these weights, loaded anew; the embedded one when `model` is empty.
  std::shared_ptr<const Encoder> LoadEncoder(const std::string& model) const;
  const std::filesystem::path& cache_folder() const { return setup_.cache_folder; }
  SceneBatch* batch() const { return setup_.batch; }
  const std::string& project() const { return setup_.project; }
  CheckpointStore& checkpoints() { return checkpoints_; }
  ProgressObserver& progress() { return progress_; }
  const CancellationToken& cancel() const { return cancel_; }

  bool HasInput(const std::string& name) const { return setup_.inputs.contains(name); }
  // File of an input artifact. Throws Error{kFailedPrecondition} naming the artifact and the stage
  // that makes it.
  std::filesystem::path Input(const std::string& name) const;
  // Names of the inputs that begin with `prefix`, sorted.
  std::vector<std::string> InputsBelow(std::string_view prefix) const;
  std::string ReadInput(const std::string& name) const;

  // Writes an artifact, atomically.
  void WriteOutput(const std::string& name, std::string_view bytes);
  // What was written under that name, and other bytes in its place.
  std::string ReadOutput(const std::string& name) const;
  void RewriteOutput(const std::string& name, std::string_view bytes);
  // As WriteOutput for a finished file in the scratch folder, which is moved.
  void TakeOutput(const std::string& name, const std::filesystem::path& file);
  // An input that this stage publishes again under its name.
  void ForwardInput(const std::string& name);

  const std::vector<std::string>& outputs() const { return outputs_; }
  const std::vector<std::string>& passed_on() const { return passed_on_; }

 private:
  // Where an artifact of this name goes; its folder is there.
  std::filesystem::path PlaceFor(const std::string& name) const;

  Setup setup_;
  CheckpointStore& checkpoints_;
  ProgressObserver& progress_;
  const CancellationToken& cancel_;
  std::unique_ptr<ThreadPool> pool_;
  std::vector<std::string> outputs_;
  std::vector<std::string> passed_on_;
};

}  // namespace color3d
