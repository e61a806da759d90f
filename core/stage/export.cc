#include "core/splat/export.h"

#include "core/stage/artifacts.h"
#include "core/stage/stages.h"

namespace color3d {

void RunExport(StageContext& context) {
  const Scene scene = ReadScene(context);
  const GaussianModel model = ParseGaussians(context.ReadInput(artifact::kModel));
  ThreadPool pool(context.threads());
  context.WriteOutput(artifact::kPly, EncodeGaussianPly(model, scene.world_offset, pool));
}

}  // namespace color3d
