// Averages the colours of successive frames along optical flow (core/film/steady_colors.h) and
// delivers each frame once its neighbours are coloured.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "core/carry/view_color.h"
#include "core/film/film_carry.h"
#include "core/film/steady_colors.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Optical flow between two frames in both directions.
std::shared_ptr<const FlowPair> FlowBetween(const Image& earlier, const Image& later);

// Not thread-safe.
class SteadyFrames {
 public:
  struct Frame {
    int frame = 0;
    FusedColor color;
    std::shared_ptr<const FlowPair> flow_from_last;  // null for the first frame
  };

  // `near`: of each frame. Key frames keep their colours; colours of frames with different nearest
  // key frames are not averaged. `was_done`: frames to leave out; may be empty. Thread-safe.
  explicit SteadyFrames(std::vector<NearKeyFrames> near,
                        std::function<bool(int frame)> was_done = {});

  // Number of frames to either side that count.
  int reach() const { return options_.reach; }
  void Add(std::vector<Frame> frames);
  // Calls `deliver`, from several threads, for the frames whose neighbours were added; for all if
  // `is_end`. Throws Error{kCancelled}.
  void Deliver(bool is_end,
               StageContext& context,
               const std::function<void(int frame, const FusedColor& color)>& deliver);

 private:
  const std::vector<NearKeyFrames> near_;
  const std::function<bool(int frame)> was_done_;
  const SteadyColorsOptions options_;
  std::vector<Frame> frames_;
  size_t delivered_ = 0;  // number of these
};

}  // namespace color3d
