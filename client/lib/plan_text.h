// The plan of a job as text, and its comparison with the seconds that the job took. Pure functions.
#pragma once

#include <string>

#include "color3d/v1/job.pb.h"

namespace color3d::client {

// Lines, each with its end: the stages that run with their expected seconds, then those that are
// left out with the seconds that this saves, with reasons, then the expected error for each time
// budget.
std::string PlanText(const v1::JobPlan& plan);

// Returns whether the measured seconds lie within a third of the expected ones.
bool IsWithinAThird(double expected_seconds, double measured_seconds);

// One line without its end, e.g. "expected 54 s of computing, took 57 s".
std::string PlanCheckText(double expected_seconds, double measured_seconds);

}  // namespace color3d::client
