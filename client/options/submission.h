// How a job is submitted: notification, priority and deadline, as the command line says.
#pragma once

#include <google/protobuf/timestamp.pb.h>

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

namespace color3d::client {

struct Submission {
  std::string notify;  // URL to notify when the job has ended; empty: none
  std::optional<int> priority;
  std::string deadline;  // as ParseDeadline takes it; empty: none
};

// Adds --notify, --priority and --deadline. Requires: `submission` outlives `app`.
void AddSubmissionFlags(CLI::App& app, Submission* submission);

// Parses "2026-01-31T18:00:00Z" (RFC 3339), or a time from now: "90m", "12h", "2d". Throws
// Error{kInvalidArgument}.
google::protobuf::Timestamp ParseDeadline(const std::string& text);

}  // namespace color3d::client
