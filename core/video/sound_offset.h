// By how much two films of one event began apart, heard in their sound (DYNAMIC.md "Poses of
// films").
#pragma once

#include <optional>
#include <vector>

#include "core/base/cancellation.h"
#include "core/video/mp4_writer.h"

namespace color3d {

inline constexpr int kSoundLevelsPerSecond = 100;

// How loud the part is, 100 times a second: log10 of the mean square of all channels, -8 for
// silence. Empty: the film has no sound, or none that can be decoded. Throws Error{kCancelled}.
std::vector<float> SoundLevels(const SoundPart& part, const CancellationToken& cancel);

// What is heard at t in `one` is heard at t - offset in `other`: the second film began `offset` s
// after the first one. None where they share no sound, or too little to tell. Exact to some 0.01 s.
std::optional<double> SoundOffset(const std::vector<float>& one, const std::vector<float>& other);

}  // namespace color3d
