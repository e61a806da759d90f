// Colour of a film's key frames carried along the film by motion (METHOD.md "Film"): every pixel is
// followed back to where it lies in a key frame, whose own colours are taken there, so that nothing
// is blurred by being resampled again and again.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/parallel.h"

namespace color3d {

struct FilmColor {
  Image ab;          // 2 channels, Lab units
  Image confidence;  // 1 channel, 0..1
};

struct FilmKey {
  int frame = 0;
  FilmColor color;  // of the working size
};

struct FilmCarryOptions {
  // Px at which following a pixel there and back again leaves a confidence of 1/e, 0.1..10.
  double flow_tolerance_px = 1.5;
  // Difference of L around a pixel and around where it lies in the key frame: confidence falls to
  // 1/e, L units, 1..100.
  double luminance_tolerance = 12.0;
  // What is left of a pixel's confidence from frame to frame, 0.5..1.
  double keep = 0.99;
  void Validate() const;  // throws Error{kInvalidArgument}
  bool operator==(const FilmCarryOptions&) const = default;
};

struct FilmFrames {
  std::vector<int> shot;  // of each frame; colours are carried within a shot only
  // L in 0..100, 1 channel, all of one size. Called from several threads at once.
  std::function<std::shared_ptr<const Image>(int frame)> luminance;
};

// Colours every frame of the shots that have a key frame from the nearest of them, and hands it to
// `on_frame` in any order, from several threads, one after the other. Frames of other shots are not
// handed over. Memory does not grow with the number of frames. Throws Error{kInvalidArgument} for
// keys that are no frames or are given twice.
void CarryAlongFilm(const FilmFrames& frames,
                    const std::vector<FilmKey>& keys,
                    const FilmCarryOptions& options,
                    ThreadPool& pool,
                    const CancellationToken& cancel,
                    const std::function<void(int frame, const FilmColor& color)>& on_frame);

}  // namespace color3d
