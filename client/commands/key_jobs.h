// Finds the jobs of a scene that selected and coloured its key view.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/lib/connection.h"
#include "color3d/v1/job.pb.h"
#include "color3d/v1/scene.pb.h"

namespace color3d::client {

struct KeyState {
  v1::Scene scene;
  // The newest succeeded jobs that were submitted alone.
  std::optional<v1::Job> selected;  // select_key_view
  std::optional<v1::Job> colored;   // colorize_key_view
  std::optional<v1::Job> accepted;  // Scene.key_color_job
};

// Throws RpcError if there is no such scene.
KeyState ReadKeyState(Connection& connection, const std::string& scene);

// Returns the job and its inputs: the inputs of a job that continues from it.
std::vector<std::string> JobAndInputs(Connection& connection, const v1::Job& job);

// key_view.json of a select_key_view job, or of the one that a colorize_key_view job read.
struct KeyViewChoice {
  std::string view;
  std::string description;         // reason of the choice and its margin; may be empty
  std::vector<std::string> views;  // all views chosen together, `view` first
};
KeyViewChoice ReadChoice(Connection& connection, const v1::Job& job);

// The source of a colorize_key_view job in words, e.g. "strokes".
std::string DescribeSource(const v1::Job& job);

v1::Scene AcceptKeyColor(Connection& connection, const std::string& scene, const std::string& job);

}  // namespace color3d::client
