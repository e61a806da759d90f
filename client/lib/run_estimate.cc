#include "client/lib/run_estimate.h"

#include <fmt/core.h>

#include "core/catalogue/stages.h"

namespace color3d::client {

void RunEstimate::OnJob(const v1::Job& job) {
  const v1::Progress& progress = job.progress();
  const std::string& error = progress.error_name();
  if (job.kind() == kind::kCarryColor) {
    if (error == kCoverageCurve) run_.carried_share = progress.error_value();
    is_carried_known_ = error == kCoverageCurve || job.state() != v1::Job::STATE_SUCCEEDED;
  } else if (job.kind() == kind::kPersonalize && error == kValidationCurve) {
    run_.uncovered_error = progress.error_value();
    is_validated_ = true;
  } else if (job.kind() == kind::kSolveChroma && error == kDisagreementCurve) {
    run_.disagreement = progress.error_value();
  }
}

std::optional<double> RunEstimate::error() const {
  if (!is_carried_known_ || !is_validated_) return std::nullopt;
  return EstimatedError(run_);
}

std::string RunEstimate::Text() const {
  const auto estimate = error();
  return estimate ? fmt::format("estimated error {:.1f}", *estimate) : "";
}

}  // namespace color3d::client
