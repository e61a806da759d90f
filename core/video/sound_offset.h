// Time offset between two films of one event, estimated from their sound (DYNAMIC.md "Poses of
// films").
#pragma once

#include <optional>
#include <vector>

#include "core/base/cancellation.h"
#include "core/video/mp4_writer.h"

namespace color3d {

inline constexpr int kSoundLevelsPerSecond = 100;

// Loudness of the part, 100 times a second: log10 of the mean square of all channels, -8 for
// silence. Empty if the film has no sound or it cannot be decoded. Throws Error{kCancelled}.
std::vector<float> SoundLevels(const SoundPart& part, const CancellationToken& cancel);

// Offset in seconds such that the sound at t in `one` is at t - offset in `other`: the second film
// began `offset` s after the first. None if they share no sound or too little. Accurate to about
// 0.01 s.
std::optional<double> SoundOffset(const std::vector<float>& one, const std::vector<float>& other);

}  // namespace color3d
