// The outcome of key view selection for programs and for people.
#pragma once

#include <string>
#include <vector>

#include "core/keyview/select.h"
#include "core/keyview/view_features.h"

namespace color3d {

struct KeyViewRanking {
  KeyViewSelection selection;
  std::vector<std::string> names;      // of the candidates, by index
  std::vector<ViewFeatures> features;  // by index; empty when the user chose
  std::string strategy;                // that was used: "coverage", "entropy", "tracks", "manual"
  std::string fallback;                // why another one than was asked for; empty: as asked for
  std::string among;                   // what it is the best of; empty: of all
  std::string encoder;                 // description; empty when no features were used
  // Where several were chosen together: all of them, best first, and the error that is expected
  // with the first, the first two, ... Else empty.
  std::vector<int> together;
  std::vector<double> expected_error;

  const std::string& Chosen() const { return names[selection.index]; }
};

// "Best of 50 views by feature coverage, clearly ahead of the next, x.jpg."
std::string DescribeKeyView(const KeyViewRanking& ranking);
// key_view.json.
std::string KeyViewToJson(const KeyViewRanking& ranking);
// key_view_ranking.jpg: the best 40 and up to 20 that were set aside. `chosen_thumbnail`
// stands for the chosen view when there are no features.
std::string KeyViewSheetJpeg(const KeyViewRanking& ranking, const Image& chosen_thumbnail);

}  // namespace color3d
