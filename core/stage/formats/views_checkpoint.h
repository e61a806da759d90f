// Checkpoints of colorize_views: the outputs of the coloured views. Thread-safe except for the
// constructor.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/base/mutex.h"
#include "core/carry/view_color.h"
#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/formats/record_checkpoint.h"

namespace color3d {

class ViewsCheckpoint {
 public:
  // Reads the checkpoint, if there is one, and writes the outputs of its views. Requires: the
  // references outlive the object.
  ViewsCheckpoint(const Scene& scene, StageContext& context);

  // Returns true if the checkpoint has the view.
  bool WasDone(int view) const { return was_done_[static_cast<size_t>(view)] != 0; }
  // Writes the outputs, reports progress, saves a checkpoint when it is due.
  void Add(int view, const FusedColor& color);

 private:
  void Keep(int view, const std::string& ab, const std::string& provenance)
      COLOR3D_REQUIRES(mutex_);

  const Scene& scene_;
  StageContext& context_;
  std::vector<char> was_done_;
  Mutex mutex_;
  int64_t done_ COLOR3D_GUARDED_BY(mutex_) = 0;
  RecordCheckpoint records_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d
