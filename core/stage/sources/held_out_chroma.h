// Error of the chroma while it is solved, on views that the solve does not see.
#pragma once

#include <memory>

#include "core/scene/view_images.h"
#include "core/splat/chroma/chroma_fit.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Observes a solve (ChromaProblem::snapshot) by the curve "heldout_delta_e00": mean CIEDE2000 of
// the chroma of renders from the predicted colours of the same views, under the photos' luminance,
// over at most two held-out views at a small size. The solve's result does not depend on it. Empty
// if no held-out view was coloured. Requires: `scene` and `context` outlive the observer.
ChromaSnapshot ObserveHeldOutChroma(const Scene& scene,
                                    const ViewImages& images,
                                    StageContext& context);

}  // namespace color3d
