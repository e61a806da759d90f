// Colours a picture by a text prompt (STILL.md "Stage 1b", `prompt`): colour phrases are located
// with CLIP's dense features and become hints, which are propagated along L. No torch in this
// interface.
#pragma once

#include <string>
#include <vector>

#include "core/base/image.h"
#include "core/base/run_control.h"
#include "core/encoder/clip/clip.h"
#include "core/keycolor/hints/hints.h"
#include "core/keycolor/words/prompt_phrases.h"

namespace color3d {

struct PromptOptions {
  // Windows per shorter side, coarse to fine; CLIP encodes each window separately. 1..8 each.
  std::vector<int> windows_per_side{1, 2, 3};
  double temperature = 0.01;     // of the softmax over phrases; CLIP was trained with 0.01. > 0
  double seed_confidence = 0.4;  // minimum lead over the next phrase for a hint, 0..1
  double min_share = 0.003;      // minimum area where a phrase leads, as share of the picture
  int map_side_px = 192;         // longer side of the maps of regions, 32..1024
  HintOptions hints;
  void Validate() const;
};

// Region of a phrase, shown in the report.
struct PromptRegion {
  ColorPhrase phrase;
  bool found = false;
  double share = 0.0;  // share of the picture where this phrase leads
  double score = 0.0;  // maximum probability, 0..1
  Image mask;          // 1 channel, probability 0..1, longer side map_side_px
};

struct PromptSolution {
  Image ab;          // 2 channels, Lab units, size of `luminance`
  Image confidence;  // 1 channel, 0..1: lead of the best phrase; 0 where no phrase fits
  std::vector<PromptRegion> regions;  // in the order of the prompt
  std::vector<std::string> notes;     // omitted words, with reasons
  HintSolution spread;                // iterations, residual and hint count (`ab` is moved out)
};

// `luminance`: 1 channel, L 0..100. `rest`: ab (2 channels, size of `luminance`) of areas that no
// phrase names, or empty for grey; used where the background fits better than any phrase. Hints
// have the colours of the phrases; L is that of the photo. Throws Error{kInvalidArgument} for a
// prompt without colours (ParsePrompt), and kFailedPrecondition with the best scores if no phrase
// was found.
PromptSolution KeyColorFromPrompt(const Image& luminance,
                                  const std::string& prompt,
                                  const TextImageModel& model,
                                  const Image& rest,
                                  const PromptOptions& options,
                                  const RunControl& control);

}  // namespace color3d
