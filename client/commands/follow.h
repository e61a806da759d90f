// Submits jobs and follows them to their end, with progress for the user.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client/commands/command.h"
#include "client/lib/connection.h"
#include "client/lib/progress_display.h"
#include "client/options/submission.h"
#include "color3d/v1/job.pb.h"

namespace color3d::client {

v1::Job SubmitJob(Connection& connection,
                  const v1::JobSpec& spec,
                  const Submission& submission = {});

// Returns true when all of them have ended (after a failure, stages that still run are not waited
// for), false when the user pressed Ctrl-C. Throws CommandFailure{kUnreachable} with the command to
// attach again if the server does not come back. `on_stage_done` is called for each stage that
// succeeds.
using StageDone = std::function<void(const v1::Job& stage)>;
bool Follow(Connection& connection,
            const std::vector<std::string>& jobs,
            const Context& context,
            ProgressDisplay& display,
            const StageDone& on_stage_done = {});

// The commands to attach again and to download the results. `out` may be empty.
std::string ReattachHint(const Context& context, const std::string& job, const std::string& out);

// Throws CommandFailure with the failed stage and the reason unless the job has succeeded.
void RequireSuccess(Connection& connection, const Context& context, const v1::Job& job);

// Follows `jobs` to their end, prints their warnings and those of their stages, and returns the
// last job in its final state. Throws CommandFailure if one has not succeeded; after Ctrl-C
// kDetached with the command to attach again. `out`: folder for the results; may be empty.
v1::Job FollowToSuccess(Connection& connection,
                        const Context& context,
                        const std::vector<std::string>& jobs,
                        const std::string& out,
                        ProgressDisplay& display,
                        const StageDone& on_stage_done = {});

// "color3d ARGUMENTS", with --server if it was given.
std::string CommandLine(const Context& context, std::vector<std::string> arguments);

}  // namespace color3d::client
