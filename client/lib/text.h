// Formats numbers and jobs for display. Pure functions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "color3d/v1/job.pb.h"
#include "google/protobuf/timestamp.pb.h"

namespace color3d::client {

std::string HumanBytes(int64_t bytes);     // "812 B", "3.2 MB"
std::string HumanSeconds(double seconds);  // "0.4 s", "72 s", "1 h 02 min"
std::string HumanClock(double seconds);    // "0:09", "12:34", "1:02:03", remaining time
std::string HumanTime(
    const google::protobuf::Timestamp& time);  // "2026-01-31 12:00:05" (UTC) or "-"

// "SUCCEEDED" for STATE_SUCCEEDED.
std::string StateName(v1::Job::State state);

// Displayed name of a stage: the kind of the job, but "report" for the last stage of a
// colorize_scene job.
std::string StageName(const v1::Job& job);

// Line for a running stage, at most `width` columns: name, bar, step, error of the stage, time
// left, `note`, message.
std::string ProgressLine(const v1::Job& job, int width, const std::string& note = "");
// Line for a finished stage: seconds and "(cached)", "left out: reason", "failed: reason" or
// "cancelled".
std::string EndLine(const v1::Job& job);

// Returns a command line that a POSIX shell splits into these arguments.
std::string ShellLine(const std::vector<std::string>& arguments);

// Aligns columns to the widest cell, with two spaces in between; the first row is the heading.
// Control characters in cells are escaped (EscapeControls).
std::string Table(std::vector<std::vector<std::string>> rows);

}  // namespace color3d::client
