// The page that shows the scene in a browser. For the export stage only.
#pragma once

#include <string>

#include "core/scene/scene.h"
#include "core/splat/export/motion/playable_scene.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/movie/page_movie.h"

namespace color3d {

struct ExportedFile {
  std::string name;  // artifact::kSog or kPly; empty: none was exported
  std::string bytes;
};

struct ViewPageContents {
  ExportedFile file;
  // What a page that plays contains in place of `file`; null: a page of one time.
  const PlayableScene* playable = nullptr;
  PageMovie movie;
};

// Writes artifact::kViewPage, which opens at the key view. `moves`: the model is that of the time
// of the key view, and the page has the photos of this time only. Returns false and writes nothing
// if there is no file or, with a warning, if this build has no viewer. Throws Error{kCancelled} and
// the errors of reading the photos.
bool WriteViewPage(const Scene& scene,
                   int key_view,
                   const GaussianModel& model,
                   bool moves,
                   ViewPageContents contents,
                   StageContext& context);

}  // namespace color3d
