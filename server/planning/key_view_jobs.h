// Additional key views in the options of stages: the planner makes a colorize_key_view job of each.
// Stateless.
#pragma once

#include <vector>

#include "color3d/v1/job.pb.h"

namespace color3d {

// Whether the key view counts in a range of time only.
inline bool HasRange(const v1::FurtherKeyView& key) { return key.has_begin_s() || key.has_end_s(); }

// The additional key views in the options of the spec's stage: all of a carry_color job, and the
// corrections of a correct_colors job that have a range of time. The pointers are into the spec.
std::vector<v1::FurtherKeyView*> AdditionalKeyViews(v1::JobSpec* spec);

// Whether it is a colorize_key_view job of an additional key view.
inline bool ColorsAdditionalKeyView(const v1::JobSpec& spec) {
  return !spec.colorize_key_view().view().empty();
}

}  // namespace color3d
