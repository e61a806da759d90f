// The stream of sound of a film's file, and its samples. For this folder only.
#pragma once

#include "core/video/libav.h"

namespace color3d {

// The one that players play: the first that is marked as the default, else the first; null: there
// is none.
AVStream* MainSound(AVFormatContext* container);

// Sample i of a channel of decoded sound, -1..1; 0 in a format that no decoder of sound hands out.
float SampleOf(const AVFrame& frame, int channel, int channels, int i);

}  // namespace color3d
