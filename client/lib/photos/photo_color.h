// Is a photograph in colour, or a monochrome one that is toned, faded, stained or noisy? Not the
// question whether a picture holds any colour at all, which core/keycolor/picture_checks.h answers.
// Pure functions, thread-safe.
#pragma once

#include "core/base/image.h"

namespace color3d::client {

// How the chroma of a picture differs from its tone: the hue and chroma that it mostly has at each
// luminance. A monochrome print has that and nothing else, whatever its toning; a stain or fading
// of the same hue is no second one.
struct HueSpread {
  double second_hue = 0.0;  // share of the picture that differs from its tone in hue, 0..1
  double scatter = 0.0;     // how far half of the picture differs from its tone, Lab units
};

// Of a 3-channel picture, sRGB in 0..1; zero for 1 channel.
HueSpread MeasureHues(const Image& srgb);

struct ColorVerdict {
  bool in_color = false;
  // False for what may be either: a print with a stain or tint of another hue, or a photograph in
  // colour most of which has one hue.
  bool is_sure = true;
};
ColorVerdict JudgeColor(const HueSpread& hues);

// JudgeColor's answer for a picture.
bool HasColor(const Image& srgb);

}  // namespace color3d::client
