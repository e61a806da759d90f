// The change of colour that an edit of a picture makes, as a function of the original colour
// (STILL.md "Recolouring"): by how much a colour changes, and how much more often it is found in
// the edited part than in the rest. Plain C++, immutable, thread-safe.
#pragma once

#include <span>
#include <vector>

#include "core/base/image.h"

namespace color3d {

struct EditedPicture {
  Image lab;     // 3 channels: the original
  Image ab;      // 2 channels, Lab units: after the edit
  Image edited;  // 1 channel, 0..1: edited share of each pixel
};

class EditModel {
 public:
  // Requires: all maps of a picture have one size.
  explicit EditModel(std::span<const EditedPicture> pictures);

  struct Answer {
    float change[2] = {0.0f, 0.0f};  // of a and b, Lab units
    float variance = 0.0f;           // of the change, sum over a and b, Lab units squared
    // Probability of the colour in the edited part over that in the rest. 1 for colours that the
    // pictures do not show, or if they have no edited part or no other one.
    float likelihood_ratio = 1.0f;
  };
  Answer At(float l, float a, float b) const;
  // Edited share of all pixels, 0..1.
  float EditedShareOfAll() const;

 private:
  struct Sums {
    float inside = 0.0f, outside = 0.0f;  // pixels
    float change[2] = {0.0f, 0.0f};
    float squares = 0.0f;
    void Add(const Sums& other, float weight);
  };
  void Blur(int stride, int size);

  std::vector<Sums> bins_;
  Sums total_;
};

// Posterior probability that a pixel is edited, from a prior probability and a likelihood ratio.
inline float EditedPosterior(float prior, float likelihood_ratio) {
  const float edited = prior * likelihood_ratio;
  return prior <= 0.0f ? 0.0f : edited / (edited + 1.0f - prior);
}

}  // namespace color3d
