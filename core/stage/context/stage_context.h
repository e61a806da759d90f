// Inputs, outputs and services of a running stage: named files in and out, threads, checkpoints,
// progress and cancellation.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
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
    std::filesystem::path output_folder;   // receives the artifacts under their names
    std::filesystem::path scratch_folder;  // for temporary files; the caller deletes it
    int threads = 1;
    uint64_t seed = 1;
    // Memory budget. 0: 60 % of the machine's available memory, at most 90 % of the memory that the
    // limit of this process leaves.
    int64_t memory_bytes = 0;
    std::map<std::string, std::filesystem::path> models;  // the user's weights, by name
    RemoteColorizerFactory remote_colorizers;             // the user's model servers; may be empty
    std::string attempt;                                  // unique to this run, e.g. "jobs/3f/2"
    std::filesystem::path cache_folder = {};  // kept between jobs (FileCache); empty: none
    SceneBatch* batch = nullptr;              // batch of personalizations; null: none
    std::string project = {};  // project of the job; scenes in a batch take turns by project
  };

  // The references must outlive the context.
  StageContext(Setup setup,
               CheckpointStore& checkpoints,
               ProgressObserver& progress,
               const CancellationToken& cancel);

  const std::filesystem::path& scene_folder() const { return setup_.scene_folder; }
  const std::filesystem::path& scratch_folder() const { return setup_.scratch_folder; }
  // Threads of this run, started at the first call. Not thread-safe.
  ThreadPool& pool();
  // The services of this context for long computations.
  RunControl control() { return {pool(), checkpoints_, progress_, cancel_}; }
  uint64_t seed() const { return setup_.seed; }
  int64_t MemoryBytes() const;
  const std::string& attempt() const { return setup_.attempt; }
  // File of the user's weights. Throws Error{kFailedPrecondition} with the known names.
  std::filesystem::path Model(const std::string& name) const;
  // Connection to a model server of the user. Throws as Model.
  std::unique_ptr<RemoteColorizer> Remote(const std::string& name) const;
  // Loads the encoder of these weights; returns the embedded one if `model` is empty.
  std::shared_ptr<const Encoder> LoadEncoder(const std::string& model) const;
  const std::filesystem::path& cache_folder() const { return setup_.cache_folder; }
  SceneBatch* batch() const { return setup_.batch; }
  const std::string& project() const { return setup_.project; }
  CheckpointStore& checkpoints() { return checkpoints_; }
  ProgressObserver& progress() { return progress_; }
  const CancellationToken& cancel() const { return cancel_; }
  void ThrowIfCancelled() const { cancel_.ThrowIfCancelled(); }
  void ReportProgress(int64_t step, int64_t total, const std::string& message) {
    progress_.OnProgress(step, total, message);
  }
  // Shows the user a warning, which the report repeats.
  void Warn(const std::string& message) { progress_.OnWarning(message); }
  // Formats the warning with fmt.
  template <typename First, typename... Rest>
  void Warn(fmt::format_string<First, Rest...> message, First&& first, Rest&&... rest) {
    Warn(fmt::format(message, std::forward<First>(first), std::forward<Rest>(rest)...));
  }

  bool HasInput(const std::string& name) const { return setup_.inputs.contains(name); }
  // File of an input artifact. Throws Error{kFailedPrecondition} with the artifact and the stage
  // that writes it.
  std::filesystem::path Input(const std::string& name) const;
  // Names of the inputs that begin with `prefix`, sorted.
  std::vector<std::string> InputsBelow(std::string_view prefix) const;
  std::string ReadInput(const std::string& name) const;

  // Writes an artifact, atomically.
  void WriteOutput(const std::string& name, std::string_view bytes);
  // Reads an artifact that this stage has written.
  std::string ReadOutput(const std::string& name) const;
  // Replaces such an artifact, atomically.
  void RewriteOutput(const std::string& name, std::string_view bytes);
  // Publishes a finished file of the scratch folder, which is moved.
  void MoveOutput(const std::string& name, const std::filesystem::path& file);
  // Publishes an input again under its name.
  void ForwardInput(const std::string& name);

  const std::vector<std::string>& outputs() const { return outputs_; }
  const std::vector<std::string>& passed_on() const { return passed_on_; }

 private:
  // Path of an output. Creates its folder.
  std::filesystem::path OutputPath(const std::string& name) const;

  Setup setup_;
  CheckpointStore& checkpoints_;
  ProgressObserver& progress_;
  const CancellationToken& cancel_;
  std::unique_ptr<ThreadPool> pool_;
  std::vector<std::string> outputs_;
  std::vector<std::string> passed_on_;
};

}  // namespace color3d
