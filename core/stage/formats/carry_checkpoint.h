// The views that carry_color has finished, kept in checkpoints so that a killed worker's successor
// does not carry into them again. They wait in a file of the scratch folder: memory does not grow
// with their number. Thread-safe but for the constructor.
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
  // Takes up the checkpoint, if there is one, and writes the outputs of its views. One that is
  // damaged is reported as a warning and ignored. The references must outlive the object.
  CarryCheckpoint(const Scene& scene, StageContext& context);

  // The checkpoint has it: nothing is left to do for this view.
  bool WasDone(int view) const { return was_done_[static_cast<size_t>(view)] != 0; }
  // Writes the output, reports progress, saves a checkpoint when it is time. `coverage`: 0..1.
  void Add(int view, double coverage, const std::string& png);
  // Reports what is done beside that.
  void Tell(const std::string& message) const;
  // The output of a view that was added.
  std::string Png(int view) const;
  // Writes another one in its place, saves a checkpoint when it is time.
  void Replace(int view, double coverage, const std::string& png);
  // By view; once all are there.
  const std::vector<double>& coverage() const { return coverage_; }

  // Of a film: how far its walks were, and how far this one is now; told before the frame is added.
  std::vector<FilmWalk> Walks() const;
  void SetWalk(const FilmWalk& walk);

 private:
  void TakeUp(const nlohmann::json& record);
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
