// Estimated error of a run that is followed (core/METHOD.md, "Plan and error of a run"), from the
// progress of its stages. Not thread-safe.
#pragma once

#include <optional>
#include <string>

#include "color3d/v1/job.pb.h"
#include "core/catalogue/error_model.h"

namespace color3d::client {

class RunEstimate {
 public:
  // Takes the errors that the job reports, if the estimate depends on its stage.
  void OnJob(const v1::Job& job);
  // CIEDE2000 of the colours. nullopt before a colorizer was validated, and if the stage that
  // carries colours ended without a report, as cached ones do.
  std::optional<double> error() const;
  // "estimated error 2.4"; empty while there is none.
  std::string Text() const;

 private:
  RunState run_;
  bool is_carried_known_ = true;  // before colours are carried their share is 0
  bool is_validated_ = false;
};

}  // namespace color3d::client
