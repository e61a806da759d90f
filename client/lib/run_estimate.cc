#include "client/lib/run_estimate.h"

#include <fmt/core.h>

#include "core/catalogue/error_model.h"
#include "core/catalogue/stages.h"

namespace color3d::client {

void RunEstimate::OnJob(const v1::Job& job) {
  const v1::Progress& progress = job.progress();
  if (job.kind() == kind::kCarryColor) {
    if (progress.error_name() == kCoverageCurve) {
      carried_share_ = progress.error_value();
    } else if (job.state() == v1::Job::STATE_SUCCEEDED) {
      carried_share_.reset();
    }
  } else if (job.kind() == kind::kPersonalize && progress.error_name() == kValidationCurve) {
    uncovered_error_ = progress.error_value();
  }
}

std::optional<double> RunEstimate::error() const {
  if (!carried_share_ || !uncovered_error_) return std::nullopt;
  return EstimatedError(*carried_share_, *uncovered_error_);
}

std::string RunEstimate::Text() const {
  const auto estimate = error();
  return estimate ? fmt::format("estimated error {:.1f}", *estimate) : "";
}

}  // namespace color3d::client
