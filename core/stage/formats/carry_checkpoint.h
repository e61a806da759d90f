// Checkpoints of carry_color: the finished views. Records are kept in a file of the scratch folder,
// so that memory does not grow with their number. Thread-safe except for the constructor.
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
  // Reads the checkpoint, if there is one, and writes the outputs of its views. A damaged one is
  // ignored with a warning. Requires: the references outlive the object.
  CarryCheckpoint(const Scene& scene, StageContext& context);

  // Returns true if the checkpoint has the view.
  bool WasDone(int view) const { return was_done_[static_cast<size_t>(view)] != 0; }
  // Writes the output, reports progress, saves a checkpoint when it is due. `coverage`: 0..1.
  void Add(int view, double coverage, const std::string& png);
  // Reports progress of other work.
  void ReportProgress(const std::string& message) const;
  // Requires: the view was added. Returns its output.
  std::string Png(int view) const;
  // Replaces the output of a view, saves a checkpoint when it is due.
  void Replace(int view, double coverage, const std::string& png);
  // By view. Requires: all views were added.
  const std::vector<double>& coverage() const { return coverage_; }

  // Films: the progress of all walks, and an update of one. Set before the frame is added.
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
