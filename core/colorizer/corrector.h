// Corrections of a coloured scene (STILL.md "Corrections"): propagates colour changes that a user
// paints on parts of some pictures to similar and near places in all pictures. No torch in this
// interface.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/image.h"

namespace color3d {

// A picture of the scene; maps of its size, or empty.
struct PlacedPicture {
  Image luminance;  // 1 channel, L 0..100
  Image ab;         // 2 channels, Lab units: current colours
  Image position;   // PictureFacts::position; empty: unknown
  Image seen;       // 1 channel, 0..1: share of the colours seen in a key view; empty: none
};

struct Correction {
  PlacedPicture picture;
  Image ab;            // 2 channels, Lab units: target colours
  Image painted;       // 1 channel, 0..1: opacity of the paint
  double reach = 1.0;  // of its colours to similar places, > 0; 1: as measured
};

// The cells of a picture as a corrector compares them. They depend on the colorizer, luminance and
// position alone, so that they can be kept for further corrections.
struct PictureCells {
  std::vector<float> features;   // cell after cell
  std::vector<float> positions;  // as PlaceSample::positions
};

std::string SerializePictureCells(const PictureCells& cells);
// nullopt: damaged.
std::optional<PictureCells> ParsePictureCells(std::string_view bytes);

// Places sampled from a picture for Corrector::Propose. A place is a cell of the encoder's grid.
struct PlaceSample {
  struct Place {
    double x, y;  // fractions of width and height, 0..1
    float seen;
    float unlike;  // squared feature distance to the nearest training cell
  };
  std::vector<Place> places;
  std::vector<float> features;   // place after place
  std::vector<float> positions;  // x y z in units of the scene's radius and 1; all 0 if unknown
};

struct CorrectedColor {
  Image change;  // 2 channels, Lab units, to be added to the picture's ab
  // 1 channel, 0..1: certainty of the change; 1 where it was painted.
  Image share;
  // 1 channel, 0..1: what the last correction has of `share` at a reach of 1; for a reach r it is
  // about pull^(1/r).
  Image pull;
  PlaceSample sample;
};

// Place where a stroke is most informative.
struct ProposedPlace {
  int picture = -1;         // index into the samples
  double x = 0.0, y = 0.0;  // fractions of width and height, 0..1
  // Share of the uncertainty of all pictures that a stroke here resolves, 0..1.
  double gain = 0.0;
};

// Made by Colorizer::Correct, which must outlive it. Immutable, thread-safe.
class Corrector {
 public:
  virtual ~Corrector() = default;
  virtual PictureCells Describe(const Image& luminance, const Image& position) const = 0;
  // Returns maps of the picture's size and up to `samples` places. `cells`: of Describe;
  // `picture.position` is not used. Throws Error{kInvalidArgument} if they are of another picture.
  virtual CorrectedColor Predict(const PlacedPicture& picture,
                                 const PictureCells& cells,
                                 int samples) const = 0;
  CorrectedColor Predict(const PlacedPicture& picture, int samples) const {
    return Predict(picture, Describe(picture.luminance, picture.position), samples);
  }
  // Returns at most `count` places, best first, each given strokes at those before it.
  virtual std::vector<ProposedPlace> Propose(std::span<const PlaceSample> samples,
                                             int count) const = 0;
};

}  // namespace color3d
