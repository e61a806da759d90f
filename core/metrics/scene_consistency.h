// ME and TC of a whole scene (METHOD.md "Metrics"), with few pictures in memory at a time.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/metrics/consistency.h"

namespace color3d {

// Maximum longer side of the compared pictures.
inline constexpr int kConsistencySidePx = 500;

// Source of the pictures of a scene. All pictures of a view have the same size.
struct ConsistencySource {
  struct Rendered {
    PosedDepth geometry;
    Image lab;  // 3 channels
  };

  // Number of views of each group, as ConsistencyPairs takes them.
  std::vector<int> groups;
  // Render of the coloured model in a view. Called for one view at a time, so that it may use the
  // pool.
  std::function<Rendered(int view)> render;
  // The photo in its predicted colours, 3 channels of Lab. Called from several threads at once.
  std::function<Image(int view)> colored_lab;
  // The photo in its true colours, 3 channels of sRGB, for views with has_truth. Called from
  // several threads at once.
  std::function<bool(int view)> has_truth;
  std::function<Image(int view)> true_srgb;
};

struct SceneConsistency {
  // On matches by optical flow of the photos' luminance (MatchByFlow): the same pixels whatever
  // model or method made the colours.
  struct Common {
    Consistency rendered, colored;
    std::optional<Consistency> truth;  // as below
  };
  Consistency rendered;              // renders of the coloured model
  Consistency colored;               // the photos in their predicted colours
  std::optional<Consistency> truth;  // the photos in their true colours
  std::optional<Common> common;      // if any view has a truth: for benchmarks
};

// Consistency over ConsistencyPairs of all groups, training and held-out views alike. Matches come
// from the depth of the model. The truth is scored if every view of the pairs has one. Throws
// Error{kCancelled} and the errors of the source.
SceneConsistency MeasureConsistency(const ConsistencySource& source,
                                    ThreadPool& pool,
                                    const CancellationToken& cancel);

}  // namespace color3d
