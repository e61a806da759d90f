// Key views beside the first one. For the stages of this layer only.
#pragma once

#include "core/carry/carry.h"
#include "core/scene/scene.h"
#include "core/scene/view_images.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/key_color_options.h"

namespace color3d {

// Its index. Throws Error: what Scene::FindView throws, kInvalidArgument when it is held out.
int ViewOfFurther(const FurtherKeyView& further, const Scene& scene);

// The user's colours of `view`, undistorted and reduced to the size of `images`; confidence 0 where
// it is not painted or masked out. Throws what SolveKeyColor throws.
CarriedColor ColorOfFurther(const FurtherKeyView& further,
                            int view,
                            const Scene& scene,
                            const ViewImages& images,
                            StageContext& context);

}  // namespace color3d
