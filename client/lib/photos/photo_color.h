// Tells photos in colour from monochrome ones that are toned, faded, stained or noisy.
// core/keycolor/picture_checks.h answers another question: whether a picture has any colour. Pure
// functions, thread-safe.
#pragma once

#include "core/base/image.h"

namespace color3d::client {

// Deviation of a picture's chroma from its tone: the prevailing hue and chroma at each luminance. A
// monochrome print has only its tone; stains or fading of the same hue count as tone.
struct HueSpread {
  double second_hue = 0.0;  // share of the picture that differs from its tone in hue, 0..1
  double scatter = 0.0;     // how far half of the picture differs from its tone, Lab units
};

// Requires: 3 channels, sRGB in 0..1, or 1 channel, for which the result is zero.
HueSpread MeasureHues(const Image& srgb);

struct ColorVerdict {
  bool in_color = false;
  // False for ambiguous pictures: a print with a stain or tint of another hue, or a photo in colour
  // most of which has one hue.
  bool is_sure = true;
};
ColorVerdict JudgeColor(const HueSpread& hues);

// Returns JudgeColor's answer for a picture.
bool HasColor(const Image& srgb);

}  // namespace color3d::client
