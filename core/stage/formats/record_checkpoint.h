// Checkpoints of stages whose results come one by one: records that wait in a file of the scratch
// folder, so that memory does not grow with their number. Not thread-safe.
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

  // `stage`: its kind; `magic`: how files of this version begin. The context must outlive it.
  RecordCheckpoint(std::string stage, std::string magic, StageContext& context);

  // Hands over the records of the last checkpoint, all of them or none: `check` throws
  // nlohmann::json::exception or Error{kNotFound, kDataLoss} for what is no record, which is
  // reported as a warning.
  void Restore(const OnRecord& check, const OnRecord& take);
  // Keeps a record for this checkpoint and all later ones.
  void Append(const nlohmann::json& record);
  // Saves a checkpoint when it is time: what was appended, and `latest`, which is asked for then.
  // Throws Error{kResourceExhausted} when the disk is full.
  void SaveWhenDue(const std::function<std::vector<nlohmann::json>()>& latest = {});

 private:
  std::filesystem::path FileOf(const char* name) const;

  const std::string stage_;
  const std::string magic_;
  StageContext& context_;
  std::ofstream file_;
};

}  // namespace color3d
