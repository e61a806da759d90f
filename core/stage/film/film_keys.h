// Chooses the key frames of a film. A key frame colours its own shot by optical flow and other
// shots by inference alone, so every shot gets one before any gets two (FILM.md "Film").
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

// Returns up to 60 training views, evenly spread, the middle ones of shots without any (the longest
// shots first), and `named` unless it is empty or held out. Frames with faults, which are shots of
// their own, only where there are no others. Ascending.
std::vector<int> CandidatesOfFilm(const Scene& scene, const std::string& named);

// Moves the selection to the best view of the film's longest shot. False when it is there already.
bool PreferLongestShot(const Scene& scene,
                       const std::vector<int>& candidates,
                       KeyViewSelection* selection);

// Chooses `count` of the candidates: one in each shot, the longest first, shots that show the place
// of a shot with a key frame last; then where there are most frames for each key frame. Within a
// shot, those with the least expected error. `kept`: candidates that may be chosen. `first` >= 0:
// the first key frame. Throws as ChooseKeyViews.
ChosenKeyViews ChooseFilmKeys(const Scene& scene,
                              const std::vector<int>& candidates,
                              const std::vector<ViewFeatures>& features,
                              const std::vector<bool>& kept,
                              int count,
                              int first,
                              StageContext& context);

struct NextFilmKey {
  int view = 0;             // middle of the shot with most open frames and no key frame
  double error_now = 0.0;   // expected CIEDE2000 over all frames
  double error_with = 0.0;  // expected CIEDE2000 with this key frame
};
// `keys`: indices of views. `coverage`: share of each view that key frames show, 0..1, shots that
// return included. Nothing when every shot of two frames or more has a key frame or is covered.
std::optional<NextFilmKey> AdviseNextFilmKey(const Scene& scene,
                                             const std::vector<int>& keys,
                                             const std::vector<double>& coverage);

}  // namespace color3d
