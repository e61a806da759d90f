// Which frames of a film to colour. A key frame colours its own shot by motion and others only by
// likeness, so every shot should get one before any gets two (METHOD.md "Film"). For the stages of
// this layer only.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/keyview/expected_error.h"
#include "core/keyview/select.h"
#include "core/keyview/view_features.h"
#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Neighbours of a film show much the same: up to 60 of its training views stand for all, evenly
// spread, and the middle one of each shot that has none so (the longest shots first). None that is
// a shot of its own (torn, blank) where there are others. `named`, unless it is empty or held out,
// is among them. Ascending.
std::vector<int> CandidatesOfFilm(const Scene& scene, const std::string& named);

// The best of the film's longest shot in place of the best of all; false where that is the same.
bool TakeFromLongestShot(const Scene& scene,
                         const std::vector<int>& candidates,
                         KeyViewSelection* selection);

// `count` of the candidates: as many as there are shots, each in another one, the longest first,
// and those that show what a shot with a key frame shows behind the others; further ones where the
// most frames are for each key frame. Within a shot those that are expected to serve its frames
// best. `kept`: candidates that may be chosen; `first` >= 0: is the first whatever it costs. Throws
// as ChooseKeyViews.
ChosenKeyViews ChooseFilmKeys(const Scene& scene,
                              const std::vector<int>& candidates,
                              const std::vector<ViewFeatures>& features,
                              const std::vector<bool>& kept,
                              int count,
                              int first,
                              StageContext& context);

struct NextFilmKey {
  int view = 0;             // the middle of the shot without a key frame of which most is open
  double error_now = 0.0;   // CIEDE2000 that is expected over all frames
  double error_with = 0.0;  // ... with this frame coloured, too
};
// `keys`: views. `coverage`: of each view, 0..1, what key frames show of it, also behind a cut in a
// shot that returns. Nothing when every shot of two frames or more has a key frame or is covered.
std::optional<NextFilmKey> AdviseNextFilmKey(const Scene& scene,
                                             const std::vector<int>& keys,
                                             const std::vector<double>& coverage);

}  // namespace color3d
