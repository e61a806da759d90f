// The plan of a job as text, and its comparison with what the job took. Pure functions.
#pragma once

#include <cstdint>
#include <string>

#include "color3d/v1/job.pb.h"

namespace color3d::client {

// Lines, each with its end: the stages that run with their expected seconds and peak memory, then
// those that are left out with the seconds and memory that this saves, with reasons, then the
// expected error for each time budget.
std::string PlanText(const v1::JobPlan& plan);

// Returns whether both differ by at most a third of the measured value.
bool IsWithinAThird(double expected, double measured);

// One line without its end, e.g. "expected 54 s of computing, took 57 s".
std::string PlanCheckText(double expected_seconds, double measured_seconds);
// The same for the peak memory, e.g. "expected a peak memory of 0.9 GB, measured 0.8 GB".
std::string MemoryCheckText(int64_t expected_bytes, int64_t measured_bytes);

}  // namespace color3d::client
