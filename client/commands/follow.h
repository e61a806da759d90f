// Submitting jobs and following them to their end, with what the user is told on the way.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client/commands/command.h"
#include "client/lib/connection.h"
#include "client/lib/progress_display.h"
#include "color3d/v1/job.pb.h"

namespace color3d::client {

// `notify_url`: told when it has ended; empty: nobody.
v1::Job SubmitJob(Connection& connection,
                  const v1::JobSpec& spec,
                  const std::string& notify_url = "");

// True when all of them have ended (stages that go on after a failure are not waited for); false
// when the user pressed Ctrl-C. Throws CommandFailure{kUnreachable} that says how to attach again
// when the server stays away. `on_stage_done` gets every stage that has succeeded, as it happens.
using StageDone = std::function<void(const v1::Job& stage)>;
bool Follow(Connection& connection,
            const std::vector<std::string>& jobs,
            const Context& context,
            ProgressDisplay& display,
            const StageDone& on_stage_done = {});

// "the job goes on; attach again with ..., then fetch ...". `out` may be empty.
std::string ReattachHint(const Context& context, const std::string& job, const std::string& out);

// Throws CommandFailure that names the stage and why, unless the job has succeeded.
void RequireSuccess(Connection& connection, const Context& context, const v1::Job& job);

// Follows `jobs` to their end, requires all to succeed, prints their warnings (and their stages')
// and returns the last, fresh. Throws CommandFailure; one of kDetached after Ctrl-C says how to
// attach again. `out` is the folder for the results; may be empty.
v1::Job FollowToSuccess(Connection& connection,
                        const Context& context,
                        const std::vector<std::string>& jobs,
                        const std::string& out,
                        ProgressDisplay& display,
                        const StageDone& on_stage_done = {});

// "color3d ARGUMENTS", with --server when it was given.
std::string CommandLine(const Context& context, std::vector<std::string> arguments);

}  // namespace color3d::client
