// Colours of the frames between two anchors of a film (core/film/anchor_frames.h). Stateless.
#pragma once

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/carry/view_color.h"
#include "core/film/film_carry.h"

namespace color3d {

// Returns an anchor's final colours for propagation, with confidence 1. A third channel holds the
// guessed share of the colours that are not seen.
FilmKey AnchorAsKey(int frame, const FusedColor& color);

// Blends the colours propagated from the anchors before and after a frame; either may be empty. The
// nearer anchor weighs more. `place`: 0..1 of the way from the one before to the one after.
CarriedColor BlendAnchors(CarriedColor before, const CarriedColor& behind, double place);

// Open share of a frame above which its colours are inferred.
inline constexpr double kWorthInferring = 0.02;
// Share of a frame that neither carried colours nor anchors cover surely.
double UncertainShare(const Image& carried_confidence, const CarriedColor& of_anchors);
// Takes `others` where they are sure and `color` is not. Returns the number of these pixels.
size_t FillUncertain(const CarriedColor& others, CarriedColor* color);
// Takes the colours inferred for a neighbouring frame where `color` is not sure. They are
// propagated with less confidence than seen colours, since inferring them anew would be no surer.
void FillFromNeighbor(const CarriedColor& answer, CarriedColor* color);

// Fuses the colour of a frame: carried colours; those of the anchors, where they are propagated
// surely, in place of inferred ones; and inferred ones where neither is sure, if that is more than
// kWorthInferring of the frame.
FusedColor ColorBetweenAnchors(const Image& luminance,
                               const CarriedColor& carried,
                               const CarriedColor& of_anchors,
                               const ColorSources& sources,
                               const CancellationToken& cancel);

}  // namespace color3d
