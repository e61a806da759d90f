#include "core/stage/idle_stages.h"

#include <algorithm>
#include <string>

#include "core/base/error.h"
#include "core/catalogue/captures.h"
#include "core/catalogue/stages.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {
namespace {

void WriteEmptyArtifacts(std::string_view stage, StageContext& context) {
  if (stage == kind::kReconstructGeometry) {
    context.WriteOutput(artifact::kGeometry, SerializeGaussians({}));
  } else if (stage == kind::kSolveChroma) {
    context.WriteOutput(artifact::kModel, SerializeGaussians({}));
  } else if (stage == kind::kExport) {
    context.WriteOutput(artifact::kExportScores, "{}\n");
  } else {
    throw Error(ErrorCode::kInternal, "the stage {} has no empty artifacts", stage);
  }
}

}  // namespace

std::string_view SkipIdleStage(std::string_view stage, StageContext& context) {
  const auto is_idle = [&](const CaptureKindInfo& info) {
    return !WhyNothingToDo(info.kind, stage).empty();
  };
  if (std::ranges::none_of(CaptureKinds(), is_idle)) return "";
  const std::string_view reason = WhyNothingToDo(ReadScene(context).kind(), stage);
  if (reason.empty()) return "";
  WriteEmptyArtifacts(stage, context);
  context.ReportProgress(1, 1, std::string(reason));
  return reason;
}

}  // namespace color3d
