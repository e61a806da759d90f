// Which of a scene's jobs tell its key view and the colour of it.
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
  // The newest of what has succeeded, of jobs that were submitted on their own.
  std::optional<v1::Job> selected;  // select_key_view
  std::optional<v1::Job> colored;   // colorize_key_view
  std::optional<v1::Job> accepted;  // Scene.key_color_job
};

// Throws RpcError: there is no such scene.
KeyState ReadKeyState(Connection& connection, const std::string& scene);

// The job and all that it read: what a later job needs as inputs to go on from it.
std::vector<std::string> WithItsInputs(Connection& connection, const v1::Job& job);

// key_view.json of a select_key_view job, or of the one that a colorize_key_view job read.
struct KeyViewChoice {
  std::string view;
  std::string description;         // how it was chosen and how clearly; may be empty
  std::vector<std::string> views;  // all that were chosen together, `view` first
};
KeyViewChoice ReadChoice(Connection& connection, const v1::Job& job);

// "strokes", "a prompt: red brick", ... of a colorize_key_view job.
std::string DescribeSource(const v1::Job& job);

v1::Scene AcceptKeyColor(Connection& connection, const std::string& scene, const std::string& job);

}  // namespace color3d::client
