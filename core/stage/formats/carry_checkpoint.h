// Checkpoints of carry_color: the finished views. Records are kept in a file of the scratch folder,
// so that memory does not grow with their number. Thread-safe except for the constructor.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/base/mutex.h"
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
  void Restore(const nlohmann::json& record) COLOR3D_REQUIRES(mutex_);
  void Keep(size_t view, double coverage, const std::string& png) COLOR3D_REQUIRES(mutex_);
  void SaveWhenDue() COLOR3D_REQUIRES(mutex_);

  const Scene& scene_;
  StageContext& context_;
  std::vector<char> was_done_;
  std::vector<double> coverage_;
  mutable Mutex mutex_;
  std::vector<char> is_done_ COLOR3D_GUARDED_BY(mutex_);
  int64_t done_ COLOR3D_GUARDED_BY(mutex_) = 0;
  // By key frame and direction.
  std::map<std::pair<int, int>, FilmWalk> walks_ COLOR3D_GUARDED_BY(mutex_);
  RecordCheckpoint records_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d
