// Claims of the paper (Color3D, ICLR 2026), and the rows of the suite that test them.
#include "tests/bench/suite/suite_table.h"

namespace color3d {

const std::vector<PaperClaim>& PaperClaims() {
  static const std::vector<PaperClaim> claims = {
      {"An image colourizer on every view is less consistent (Table 1, ME)",
       "paper",
       "automatic",
       "me",
       ""},
      {"An image colourizer on every view has a larger error (Table 1)",
       "paper",
       "automatic",
       "delta_e00_chroma",
       ""},
      {"Propagation by a video method has a larger error (Table 1)",
       "paper",
       "flow",
       "delta_e00_chroma",
       ""},
      {"Selection of the key view (Table 3)", "paper", "paper_random_key", "delta_e00_chroma", ""},
      {"Generated pictures (Table 3)", "paper", "paper_no_generated", "delta_e00_chroma", ""},
      {"Augmentation of the single view (Table 3)",
       "paper",
       "paper_no_augmentation",
       "delta_e00_chroma",
       ""},
      {"The pre-trained encoder (Table 3)",
       "paper",
       "paper_random_encoder",
       "delta_e00_chroma",
       ""},
      {"Gaussians in Lab have a smaller error than in RGB (Table 3)",
       "paper",
       "paper_rgb",
       "delta_e00",
       ""},
      {"Gaussians in Lab are fewer than in RGB (Table 7)", "paper", "paper_rgb", "gaussians", ""},
      {"Gaussians in Lab take less time than in RGB (Table 7)",
       "paper",
       "paper_rgb",
       "seconds_total",
       ""},
      {"One key view is better than two (Table 6)",
       "paper",
       "paper_two_keys",
       "delta_e00_chroma",
       ""},
      {"A colorizer for each scene is better than a general one (Table 4)",
       "personalized",
       "feed_forward",
       "delta_e00_chroma",
       ""},
      {"Colours from words (Table 1)", "", "", "", "needs published weights"},
      {"Old films and photographs (figure)", "", "", "", "there are no true colours"},
      {"Radiance fields (Table 8)", "", "", "", "there is no such representation here"},
      {"Preference of users (user study)", "", "", "", "needs people"}};
  return claims;
}

}  // namespace color3d
