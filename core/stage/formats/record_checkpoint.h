// Checkpoints of stages that make results one by one: records in a file of the scratch folder, so
// that memory does not grow with their number. Not thread-safe.
#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/stage/context/stage_context.h"

namespace color3d {

class RecordCheckpoint {
 public:
  using OnRecord = std::function<void(const nlohmann::json&)>;

  // `stage`: its kind; `magic`: first bytes of files of this version. Requires: the context
  // outlives the object.
  RecordCheckpoint(std::string stage, std::string magic, StageContext& context);

  // Calls `take` for the records of the last checkpoint, if `check` accepts all of them. `check`
  // throws nlohmann::json::exception or Error{kNotFound, kDataLoss} for an invalid record; the
  // checkpoint is then ignored with a warning.
  void Restore(const OnRecord& check, const OnRecord& take);
  // Adds a record to this checkpoint and all later ones.
  void Append(const nlohmann::json& record);
  // Saves a checkpoint when it is due: the appended records, then those of `latest`. Throws
  // Error{kResourceExhausted} if the disk is full.
  void SaveWhenDue(const std::function<std::vector<nlohmann::json>()>& latest = {});

 private:
  std::filesystem::path FileOf(const char* name) const;

  const std::string stage_;
  const std::string magic_;
  StageContext& context_;
  std::ofstream file_;
};

}  // namespace color3d
