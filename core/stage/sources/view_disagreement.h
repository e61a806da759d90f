// Disagreement of the coloured views at the start of the chroma solve (core/METHOD.md, "Plan and
// error of a run").
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/progress.h"
#include "core/catalogue/error_model.h"

namespace color3d {

// Passes all calls on and keeps the first "train_l1_ab": the mean difference of a, b between the
// views and renders of the closed form, their mean on the Gaussians. Not thread-safe, as the
// solver reports from one thread.
class ViewDisagreement : public ProgressObserver {
 public:
  explicit ViewDisagreement(ProgressObserver& outer) : outer_(outer) {}  // `outer` must outlive it

  void OnProgress(int64_t step, int64_t total_steps, const std::string& message) override {
    outer_.OnProgress(step, total_steps, message);
  }
  void OnError(int64_t iteration, const std::string& error_name, double value) override {
    // A solve that resumes begins at a later iteration, with smaller differences.
    if (iteration == 0 && error_name == "train_l1_ab" && !first_) first_ = value;
    outer_.OnError(iteration, error_name, value);
  }
  void OnWarning(const std::string& message) override { outer_.OnWarning(message); }

  // Reports it under its own name, last, so that it stays in the progress of the job.
  void Report() {
    if (first_) outer_.OnError(0, kDisagreementCurve, *first_);
  }

 private:
  ProgressObserver& outer_;
  std::optional<double> first_;
};

}  // namespace color3d
