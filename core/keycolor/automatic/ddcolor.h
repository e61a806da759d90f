// DDColor as automatic colourizer: ConvNeXt, decoder and output layer from one published weight
// file. Immutable after construction, thread-safe. No torch in this interface.
#pragma once

#include <memory>
#include <string>

#include "core/keycolor/automatic/automatic.h"
#include "core/weights/weight_map.h"

namespace color3d {

class ConvNext;
class DdcolorDecoder;

class Ddcolor : public AutomaticColorizer {
 public:
  // Returns whether the names are those of a DDColor state dict.
  static bool Recognizes(const WeightMap& weights);

  // Throws Error{kInvalidArgument} listing arrays that are missing, unexpected or misshapen.
  explicit Ddcolor(WeightMap weights);
  ~Ddcolor() override;

  // The published pipeline: grey RGB of L at 512x512, ab upsampled to the picture's size, here
  // guided by L instead of by nearest neighbours. The network has no confidence, so it is 1
  // everywhere.
  AutomaticColor Colorize(const Image& luminance) const override;
  const std::string& description() const override { return description_; }
  const std::string& digest() const override { return digest_; }

  const ConvNext& encoder() const { return *encoder_; }
  // The network alone: returns ab for grey RGB in 0..1 (3 channels, sides multiples of 32), same
  // size.
  Image Predict(const Image& gray_rgb) const;

 private:
  std::unique_ptr<const ConvNext> encoder_;
  std::unique_ptr<const DdcolorDecoder> decoder_;
  std::string digest_;
  std::string description_;
};

}  // namespace color3d
