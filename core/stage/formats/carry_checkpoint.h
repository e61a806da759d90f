// Checkpoints of the views that carry_color has finished, so that the successor of a killed worker
// does not carry into them again. They are collected in a file of the scratch folder to bound
// memory. Thread-safe but for the constructor.
#pragma once

#include <map>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/film/film_carry.h"
#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/formats/record_checkpoint.h"

namespace color3d {

class CarryCheckpoint {
 public:
  // Resumes from the checkpoint, if there is one, and writes the outputs of its views. A damaged
  // one is ignored with a warning. The references must outlive the object.
  CarryCheckpoint(const Scene& scene, StageContext& context);

  // Whether the checkpoint contains the view, which needs no work then.
  bool WasDone(int view) const { return was_done_[static_cast<size_t>(view)] != 0; }
  // Writes the output, reports progress, and saves a checkpoint when one is due. `coverage`: 0..1.
  void Add(int view, double coverage, const std::string& png);
  // Reports other work as progress.
  void ReportProgress(const std::string& message) const;
  // Returns the output of a view that was added.
  std::string Png(int view) const;
  // Replaces that output, and saves a checkpoint when one is due.
  void Replace(int view, double coverage, const std::string& png);
  // By view. Requires: all views were added.
  const std::vector<double>& coverage() const { return coverage_; }

  // Films only: the walks of the checkpoint, and the state of a walk, set before its frame is
  // added.
  std::vector<FilmWalk> Walks() const;
  void SetWalk(const FilmWalk& walk);

 private:
  void Restore(const nlohmann::json& record);
  void Keep(size_t view, double coverage, const std::string& png);
  void SaveWhenDue();

  const Scene& scene_;
  StageContext& context_;
  std::vector<char> was_done_;
  std::vector<char> is_done_;
  mutable std::mutex mutex_;
  std::vector<double> coverage_;
  int64_t done_ = 0;
  std::map<std::pair<int, int>, FilmWalk> walks_;  // by key frame and direction
  RecordCheckpoint records_;
};

}  // namespace color3d
