// The colour of a film's frames between two anchors (core/film/anchor_frames.h). Stateless.
#pragma once

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/carry/view_color.h"
#include "core/film/film_carry.h"

namespace color3d {

// An anchor's delivered colours as colours to be followed, all of them sure; a third channel has
// the share that is guessed of what is not seen.
FilmKey AnchorAsKey(int frame, const FusedColor& color);

// What a frame has of the anchors before and behind it (either may be empty), of which the nearer
// weighs more. `place`: 0..1 of the way from the one before to the one behind.
CarriedColor OfBothAnchors(CarriedColor before, const CarriedColor& behind, double place);

// Share of a frame from which its own sources are worth asking.
inline constexpr double kWorthAsking = 0.02;
// Share of a frame that neither what was carried into it nor the anchors tell surely.
double ShareOpen(const Image& carried_confidence, const CarriedColor& of_anchors);
// Takes `others` where they tell surely and `color` does not; how many pixels these are.
size_t FillOpen(const CarriedColor& others, CarriedColor* color);
// Takes what a neighbouring frame was told by its sources where `color` tells nothing surely: an
// answer goes on less sure ways than what was seen does, to be asked anew would not be surer.
void TakeAnswer(const CarriedColor& answer, CarriedColor* color);

// The colour of a frame: what was carried into it, as in all views; what `of_anchors` tells where
// that is followed surely in place of what the frame's own sources would say, which are asked
// where neither tells, if that is more than kWorthAsking.
FusedColor ColorBetweenAnchors(const Image& luminance,
                               const CarriedColor& carried,
                               const CarriedColor& of_anchors,
                               const ColorSources& sources,
                               const CancellationToken& cancel);

}  // namespace color3d
