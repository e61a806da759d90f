// When a movie shows frames that have times of their own, and what is heard with them. For the
// stages of this layer only.
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
  std::vector<double> time_s;     // of each frame, from the first one's
  std::vector<double> seconds;    // to the next one
  double frames_per_second = 25;  // as is usual, 1..120
};

// Of frames at these times of the scene, in the order in which they are shown. Gaps that frames of
// no use have left stay gaps, so that what is heard fits what is seen; a time that goes back, where
// another camera's film begins, follows at the usual step.
FilmClock ClockOf(const std::vector<double>& times_s);

// Nothing where the import has left no facts, as in tests.
std::optional<ImportFacts> FindImportFacts(const StageContext& context);

// Whether the scene's times are seconds, as those of films and of times.txt are: others may also
// count from 0 to 1 for the whole.
bool TimesAreSeconds(const Scene& scene, const std::optional<ImportFacts>& facts);

// What is heard in the film that `view` is a frame of, from this time of the scene on, as long as
// the clock runs; nothing for frames that came as pictures and for films without sound.
std::optional<SoundPart> SoundFrom(const Scene& scene,
                                   int view,
                                   double begin_s,
                                   const FilmClock& clock,
                                   const StageContext& context);

}  // namespace color3d
