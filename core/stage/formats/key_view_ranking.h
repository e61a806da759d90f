// Result of the key view selection, as JSON, as text and as a contact sheet. Pure functions.
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
  std::string strategy;                // the one used: "coverage", "entropy", "tracks", "manual"
  std::string fallback;  // reason for which the requested strategy was not used; empty: it was
  std::string among;     // the set that the view is the best of; empty: all candidates
  std::string encoder;   // description; empty if no features were used
  // Only if several were chosen together: all of them, best first, and the expected error with the
  // first, the first two, and so on.
  std::vector<int> together;
  std::vector<double> expected_error;

  const std::string& Chosen() const { return names[selection.index]; }
};

// E.g. "feature coverage".
std::string StrategyInWords(const std::string& strategy);

// E.g. "Best of 50 views by feature coverage, clearly ahead of x.jpg."
std::string DescribeKeyView(const KeyViewRanking& ranking);
// key_view.json.
std::string KeyViewToJson(const KeyViewRanking& ranking);
// key_view_ranking.jpg: the best 40 views and up to 20 that were set aside. `chosen_thumbnail`: the
// picture of the chosen view if there are no features.
std::string KeyViewSheetJpeg(const KeyViewRanking& ranking, const Image& chosen_thumbnail);

}  // namespace color3d
