#include "core/stage/context/stage_context.h"

#include <algorithm>

#include "core/base/files.h"
#include "core/base/memory.h"
#include "core/catalogue/stages.h"

namespace color3d {

StageContext::StageContext(Setup setup,
                           CheckpointStore& checkpoints,
                           ProgressObserver& progress,
                           const CancellationToken& cancel)
    : setup_(std::move(setup)), checkpoints_(checkpoints), progress_(progress), cancel_(cancel) {}

ThreadPool& StageContext::pool() {
  if (!pool_) pool_ = std::make_unique<ThreadPool>(setup_.threads);
  return *pool_;
}

int64_t StageContext::MemoryBytes() const {
  // The rest is a reserve: for other processes, and for growth of this one meanwhile.
  constexpr double kShareOfMachine = 0.6, kShareOfOwn = 0.9;
  if (setup_.memory_bytes > 0) return setup_.memory_bytes;
  return static_cast<int64_t>(
      std::min(kShareOfMachine * static_cast<double>(AvailableOnMachineBytes()),
               kShareOfOwn * static_cast<double>(OwnMemoryLeftBytes())));
}

std::filesystem::path StageContext::Model(const std::string& name) const {
  const auto found = setup_.models.find(name);
  if (found != setup_.models.end()) return found->second;
  std::string known;
  for (const auto& [other, file] : setup_.models) known += (known.empty() ? "" : ", ") + other;
  throw Error(
      ErrorCode::kFailedPrecondition,
      "this server has no model '{0}' (it has: {1}); start it with --model {0}=FILE and retry "
      "the job",
      name,
      known.empty() ? "none" : known);
}

std::unique_ptr<RemoteColorizer> StageContext::Remote(const std::string& name) const {
  if (!setup_.remote_colorizers) {
    throw Error(
        ErrorCode::kFailedPrecondition,
        "this server has no backend '{0}'; start it with --backend {0}=ADDRESS and retry the "
        "job",
        name);
  }
  return setup_.remote_colorizers(name);
}

std::shared_ptr<const Encoder> StageContext::LoadEncoder(const std::string& model) const {
  if (model.empty()) return Encoder::Embedded();
  return Encoder::FromWeightFile(Model(model));
}

std::filesystem::path StageContext::Input(const std::string& name) const {
  const auto found = setup_.inputs.find(name);
  if (found == setup_.inputs.end()) {
    const Stage* writer = FindProducer(name);
    throw Error(ErrorCode::kFailedPrecondition,
                "this stage needs {}, which {} writes: name such a job among the inputs",
                name,
                writer != nullptr ? writer->kind : "another stage");
  }
  return found->second;
}

std::vector<std::string> StageContext::InputsBelow(std::string_view prefix) const {
  std::vector<std::string> names;
  for (const auto& [name, path] : setup_.inputs) {
    if (name.starts_with(prefix)) names.push_back(name);
  }
  return names;
}

std::string StageContext::ReadInput(const std::string& name) const { return ReadFile(Input(name)); }

std::filesystem::path StageContext::OutputPath(const std::string& name) const {
  if (!IsSafeRelativePath(name)) {
    throw InvalidArgument("\"{}\" cannot name an artifact; rename the photo", name);
  }
  const std::filesystem::path path = setup_.output_folder / name;
  std::error_code error;
  std::filesystem::create_directories(path.parent_path(), error);
  return path;
}

void StageContext::WriteOutput(const std::string& name, std::string_view bytes) {
  WriteFileAtomic(OutputPath(name), bytes);
  outputs_.push_back(name);
}

std::string StageContext::ReadOutput(const std::string& name) const {
  return ReadFile(setup_.output_folder / name);
}

void StageContext::RewriteOutput(const std::string& name, std::string_view bytes) {
  WriteFileAtomic(OutputPath(name), bytes);
}

void StageContext::MoveOutput(const std::string& name, const std::filesystem::path& file) {
  PublishFile(file, OutputPath(name));
  outputs_.push_back(name);
}

void StageContext::ForwardInput(const std::string& name) {
  Input(name);
  passed_on_.push_back(name);
}

}  // namespace color3d
