// Additional key views in the options of stages, each of which the planner turns into a
// colorize_key_view job. Stateless.
#pragma once

#include <vector>

#include "color3d/v1/job.pb.h"

namespace color3d {

// Returns true if the key view applies to a range of time only.
// Whether the input for a backend is points above the colours of another source.
inline bool HasPointsAbove(const v1::KeyColorSource& source) {
  return source.source_case() != v1::KeyColorSource::kBackend && source.has_backend_input() &&
         source.backend_input().has_points();
}

inline bool HasRange(const v1::FurtherKeyView& key) { return key.has_begin_s() || key.has_end_s(); }

// Returns pointers into the spec to its additional key views: all of a carry_color job, and the
// corrections with a range of time of a correct_colors job.
std::vector<v1::FurtherKeyView*> AdditionalKeyViews(v1::JobSpec* spec);

// Returns true for a colorize_key_view job of an additional key view.
inline bool ColorsAdditionalKeyView(const v1::JobSpec& spec) {
  return !spec.colorize_key_view().view().empty();
}

}  // namespace color3d
