// Runs the stages of one scene in this process, one after the other, with folders in place of
// blobs. For benchmarks and tests.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/stage/run_stages.h"

namespace color3d {

class LocalPipeline {
 public:
  // Artifacts are written to `out_folder`, messages to `say` (may be empty).
  LocalPipeline(std::filesystem::path scene_folder,
                std::filesystem::path out_folder,
                int threads,
                uint64_t seed,
                std::function<void(const std::string&)> say);

  // Runs import, with every eighth view held out.
  void ImportScene();
  // Runs the selection of the key view; `view`: its name, empty: by the default strategy.
  void SelectKeyView(const std::string& view);
  // Runs `stage` as job kind `kind` with all artifacts written so far as inputs. `folder`: prefix
  // of its own artifacts, ending in "/"; may be empty.
  void Run(const std::string& kind,
           const std::function<void(StageContext&)>& stage,
           const std::string& folder = "");

  // Adds one artifact of an earlier run, or all in `out_folder`, as if their stages had run.
  void Take(const std::string& name, const std::filesystem::path& file) { artifacts_[name] = file; }
  void TakeAll();

  // Throws Error{kInvalidArgument} if no stage of this run, and no earlier run, has written it.
  std::filesystem::path ArtifactPath(const std::string& name) const;
  const std::map<std::string, std::filesystem::path>& artifacts() const { return artifacts_; }
  const std::vector<StageSummary>& summaries() const { return summaries_; }

 private:
  std::filesystem::path scene_folder_;
  std::filesystem::path out_folder_;
  int threads_;
  uint64_t seed_;
  std::function<void(const std::string&)> say_;
  std::map<std::string, std::filesystem::path> artifacts_;
  std::vector<StageSummary> summaries_;
};

}  // namespace color3d
