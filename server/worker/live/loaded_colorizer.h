// A colorizer that live pictures are coloured with.
#pragma once

#include <cstdint>
#include <memory>

#include "core/colorizer/colorizer.h"
#include "core/encoder/encoder.h"
#include "server/worker/live/byte_bound_cache.h"

namespace color3d {

struct LoadedColorizer {
  std::shared_ptr<const Colorizer> colorizer;
  std::shared_ptr<const Encoder> encoder;  // shared with other colorizers
  int64_t bytes = 0;                       // without the encoder
};

using ColorizerCache = ByteBoundCache<LoadedColorizer>;

}  // namespace color3d
