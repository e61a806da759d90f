// Expected peak memory of a stage as a function of its work. Plans, the reduction of geometry to
// the available memory and the report share it. Pure functions, thread-safe.
#pragma once

#include <cstdint>
#include <string_view>

#include "core/catalogue/cost_model.h"

namespace color3d {

// Training of geometry.
struct GeometryMemory {
  int64_t largest_photo_px = 0;    // at full size: determines the memory of decoding
  int64_t largest_picture_px = 0;  // at working size
  int64_t all_pictures_px = 0;
  int64_t gaussians = 0;
  int sh_degree = 0;              // of every channel, 0..3
  int channels = 1;               // that are trained; 3: also on chroma
  bool moves = false;             // the views are frames, possibly many: caches stay small
  int64_t deformation_bytes = 0;  // of a deformation field
};

// Largest cache of training pictures.
int64_t TargetCacheBytes(bool moves);
// Memory of decoding a photo to a working picture, its result included.
int64_t PhotoBytes(int64_t pixels);

// Per Gaussian, in floats, with R = 11 + channels (degree + 1)^2 parameters: parameters and two
// Adam moments (3R), the last good state (3R), the gradient (R), one copy while densifying (R), a
// checkpoint being written (3R), and 32 for splats, sorting keys and statistics; that is 1008 bytes
// at degree 2 and 1316 at degree 3 in one channel.
int64_t BytesPerGaussian(int sh_degree, int channels = 1);
// The same and its (Gaussian, tile) pairs of 42 bytes: about 8 pairs a Gaussian.
int64_t BytesPerGaussianWithPairs(int sh_degree, int channels);

// Peak memory of training geometry with the smallest caches, the program included. Each tile has at
// least 400 pairs. Measured on fern at degree 2 without checkpoints: 1.2 kB a Gaussian, pairs and
// all; whole peaks were 14 to 31 % below the estimate.
int64_t GeometryBytes(const GeometryMemory& memory);

// Peak resident memory of a worker during a stage; photos are assumed to have the working size.
// Throws Error{kInternal} if there is no such kind.
int64_t EstimatePeakBytes(std::string_view stage, const StageWork& work);

}  // namespace color3d
