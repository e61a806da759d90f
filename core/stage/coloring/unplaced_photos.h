// Colours of the photos of a scene whose cameras could not be found (Scene::unplaced). Stateless.
#pragma once

#include "core/stage/coloring/view_coloring.h"

namespace color3d {

// Writes their colours as artifact::kViewsAb: carried from the views that share things with them
// (PictureCarry), else as ColorByFusion infers them. Does nothing if the scene has no such photos.
// Requires: a colorizer. Throws Error{kCancelled}.
void ColorUnplacedPhotos(const ViewColoring& coloring, StageContext& context);

}  // namespace color3d
