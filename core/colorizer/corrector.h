// Corrections of a coloured scene (STILL.md "Corrections"): what a user wants changed on parts of
// some pictures reaches what is alike and near in all of them. No torch in this interface.
#pragma once

#include <span>
#include <vector>

#include "core/base/image.h"

namespace color3d {

// A picture of the scene; maps of its size, or empty.
struct PlacedPicture {
  Image luminance;  // 1 channel, L 0..100
  Image ab;         // 2 channels, Lab units: its colours as they are
  Image position;   // PictureFacts::position; empty: not known
  Image seen;       // 1 channel, 0..1: share of its colours that a key view shows; empty: none
};

struct Correction {
  PlacedPicture picture;
  Image ab;       // 2 channels, Lab units: the colours that are wanted
  Image painted;  // 1 channel, 0..1: where they are given
};

// Places drawn from a picture, for Corrector::Propose. A place is a cell of the encoder's grid.
struct PlaceSample {
  struct Place {
    double x, y;  // 0..1 of the picture
    float seen;
    float unlike;  // squared distance of its features to the nearest that colours were learnt from
  };
  std::vector<Place> places;
  std::vector<float> features;   // of one place after the other
  std::vector<float> positions;  // x y z in units of the scene's radius, and 1 where known, else 0
};

struct CorrectedColor {
  Image change;  // 2 channels, Lab units, to be added to the picture's ab
  // 1 channel, 0..1: how far the corrections tell what the change is; 1 where they were painted.
  Image share;
  PlaceSample sample;
};

// Where one stroke would tell most.
struct ProposedPlace {
  int picture = -1;         // index into the samples
  double x = 0.0, y = 0.0;  // 0..1 of that picture
  // How much of what is uncertain about all pictures it would tell, 0..1.
  double gain = 0.0;
};

// Refers to the colorizer that made it (Colorizer::Correct). Immutable, thread-safe.
class Corrector {
 public:
  virtual ~Corrector() = default;
  // Of the picture's size; draws up to `samples` places.
  virtual CorrectedColor Predict(const PlacedPicture& picture, int samples) const = 0;
  // At most `count` places, the best first, each after those before it have been painted.
  virtual std::vector<ProposedPlace> Propose(std::span<const PlaceSample> samples,
                                             int count) const = 0;
};

}  // namespace color3d
