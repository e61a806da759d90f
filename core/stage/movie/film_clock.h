// Times at which a movie shows frames, and the sound that belongs to them. For stages only.
#pragma once

#include <optional>
#include <vector>

#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/formats/artifact_io.h"
#include "core/video/mp4_writer.h"

namespace color3d {

struct FilmClock {
  int ticks_per_second = 0;
  std::vector<double> time_s;     // of each frame, relative to the first
  std::vector<double> seconds;    // from each frame to the next
  double frames_per_second = 25;  // typical rate, 1..120
};

// Clock for frames at these times, in the order in which they are shown. Gaps remain, so that sound
// and picture stay in step. A frame with an earlier time than the one before, from the film of
// another camera, follows after the typical step.
FilmClock ClockOf(const std::vector<double>& times_s);

// nullopt if there are no facts of the import among the inputs.
std::optional<ImportFacts> FindImportFacts(const StageContext& context);

// Returns true if the times of the scene are seconds, as for films and times.txt. Other times may
// run from 0 to 1.
bool TimesAreSeconds(const Scene& scene, const std::optional<ImportFacts>& facts);

// Sound of the film that `view` is a frame of, from `begin_s` for the duration of the clock;
// nullopt for frames that came as pictures and for films without sound.
std::optional<SoundPart> SoundFrom(const Scene& scene,
                                   int view,
                                   double begin_s,
                                   const FilmClock& clock,
                                   const StageContext& context);

}  // namespace color3d
