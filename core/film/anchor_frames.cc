#include "core/film/anchor_frames.h"

#include <algorithm>
#include <cstdint>
#include <map>

#include "core/base/range_check.h"
#include "core/film/frame_motion.h"
#include "core/image/codec.h"
#include "core/image/optical_flow.h"

namespace color3d {
namespace {

constexpr int kSidePx = 160;  // longer side of the compared pictures

// Motion of each frame of a shot from the one before it.
std::vector<double> MotionOf(const FilmFrames& frames,
                             const std::vector<int>& shot,
                             ThreadPool& pool,
                             const CancellationToken& cancel) {
  constexpr int64_t kAtOnce = 64;  // frames; bounds memory
  const auto count = static_cast<int64_t>(shot.size());
  std::vector<double> motion(shot.size(), 0.0);
  std::vector<Image> pictures(kAtOnce + 1);  // the first is the last one of the block before
  for (int64_t begin = 0; begin < count; begin += kAtOnce) {
    const int64_t size = std::min(kAtOnce, count - begin);
    pool.ForEach(size, [&](int64_t i, int) {
      cancel.ThrowIfCancelled();
      pictures[i + 1] = FitWithin(*frames.luminance(shot[begin + i]), kSidePx);
    });
    pool.ForEach(size, [&](int64_t i, int) {
      if (begin + i > 0) motion[begin + i] = MotionOf(DenseFlow(pictures[i], pictures[i + 1]));
    });
    pictures[0] = std::move(pictures[size]);
  }
  return motion;
}

}  // namespace

void AnchorOptions::Validate() const {
  const RangeCheck check("anchor option");
  check("most_motion", most_motion, 0, 1);
  check("most_frames", most_frames, 1, 1000);
}

std::vector<int> AnchorFrames(const FilmFrames& frames,
                              const AnchorOptions& options,
                              ThreadPool& pool,
                              const CancellationToken& cancel) {
  options.Validate();
  std::map<int, std::vector<int>> shots;
  for (int i = 0; i < static_cast<int>(frames.shot.size()); ++i) {
    shots[frames.shot[i]].push_back(i);
  }
  std::vector<int> anchors;
  for (const auto& [number, shot] : shots) {
    const std::vector<double> motion = MotionOf(frames, shot, pool, cancel);
    size_t begin = 0;
    double sum = 0.0;
    for (size_t i = 1; i <= shot.size(); ++i) {
      if (i < shot.size()) {
        sum += motion[i];
        if (sum <= options.most_motion && i - begin < static_cast<size_t>(options.most_frames)) {
          continue;
        }
      }
      anchors.push_back(shot[(begin + i - 1) / 2]);
      begin = i;
      sum = 0.0;
    }
  }
  std::sort(anchors.begin(), anchors.end());
  return anchors;
}

}  // namespace color3d
