#include "server/planning/key_view_jobs.h"

namespace color3d {

std::vector<v1::FurtherKeyView*> AdditionalKeyViews(v1::JobSpec* spec) {
  std::vector<v1::FurtherKeyView*> views;
  if (spec->has_carry_color()) {
    for (auto& view : *spec->mutable_carry_color()->mutable_further_key_views()) {
      views.push_back(&view);
    }
  }
  if (spec->has_correct_colors()) {
    for (auto& correction : *spec->mutable_correct_colors()->mutable_corrections()) {
      if (HasRange(correction)) views.push_back(&correction);
    }
  }
  return views;
}

}  // namespace color3d
