// Selection of a film's audio stream, and its samples. For this folder only.
#pragma once

#include "core/video/libav.h"

namespace color3d {

// The stream that players choose: the first one marked as default, else the first; null if there is
// none.
AVStream* MainSound(AVFormatContext* container);

// Sample i of a channel of decoded sound, -1..1; 0 for formats that no audio decoder outputs.
float SampleOf(const AVFrame& frame, int channel, int channels, int i);

}  // namespace color3d
