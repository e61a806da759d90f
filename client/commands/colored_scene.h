// Finds the coloured scene that a user names by its folder of results, its job or its scene.
#pragma once

#include <string>

#include "client/lib/connection.h"
#include "color3d/v1/job.pb.h"

namespace color3d::client {

// Returns true for "jobs/..." and "scenes/..." unless a file or folder has that name.
bool IsOnServer(const std::string& target);

// Returns the newest colorize_scene job of the scene that has succeeded. Throws RpcError if there
// is no such scene, and Error{kFailedPrecondition} with the remedy if there is no such job.
v1::Job NewestResult(Connection& connection, const std::string& scene);

// Returns the job that made the model of a folder of results ("color3d colorize -o"), jobs/ID or
// scenes/ID. The job of a folder is found by the digest of its model. Throws Error: kNotFound if
// there is no such folder, kFailedPrecondition if there is no model or the server does not know it.
v1::Job FindColoredScene(Connection& connection, const std::string& target);

}  // namespace color3d::client
