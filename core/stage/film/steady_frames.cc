#include "core/stage/film/steady_frames.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/image/optical_flow.h"

namespace color3d {

std::shared_ptr<const FlowPair> FlowBetween(const Image& earlier, const Image& later) {
  return std::make_shared<const FlowPair>(
      FlowPair{DenseFlow(earlier, later), DenseFlow(later, earlier)});
}

SteadyFrames::SteadyFrames(std::vector<NearKeyFrames> near, std::function<bool(int frame)> was_done)
    : near_(std::move(near)), was_done_(std::move(was_done)) {}

void SteadyFrames::Add(std::vector<Frame> frames) {
  std::ranges::move(frames, std::back_inserter(frames_));
}

void SteadyFrames::Deliver(bool is_end,
                           StageContext& context,
                           const std::function<void(int frame, const FusedColor& color)>& deliver) {
  const auto before = [&](size_t end) {
    return end - std::min(end, static_cast<size_t>(options_.reach));
  };
  const size_t end = is_end ? frames_.size() : before(frames_.size());
  std::vector<MovingFrame> neighbors;
  int last_nearest = -1;
  for (const Frame& one : frames_) {
    const int nearest = near_[one.frame].nearest;
    neighbors.push_back({&one.color.ab, nearest == last_nearest ? one.flow_from_last : nullptr});
    last_nearest = nearest;
  }
  context.pool().ForEach(static_cast<int64_t>(end - delivered_), [&](int64_t i, int) {
    context.ThrowIfCancelled();
    const size_t index = delivered_ + static_cast<size_t>(i);
    const int frame = frames_[index].frame;
    if (was_done_ && was_done_(frame)) return;
    FusedColor color = frames_[index].color;
    if (near_[frame].nearest != frame) {
      color.ab = SteadyColors(neighbors, static_cast<int>(index), options_);
    }
    deliver(frame, color);
  });
  // Later frames need the last ones.
  const size_t done_with = before(end);
  frames_.erase(frames_.begin(), frames_.begin() + static_cast<std::ptrdiff_t>(done_with));
  delivered_ = end - done_with;
}

}  // namespace color3d
