// The finished work that a user names: the folder that it was downloaded to, its job or its scene.
#pragma once

#include <string>

#include "client/lib/connection.h"
#include "color3d/v1/job.pb.h"

namespace color3d::client {

// True for "jobs/..." and "scenes/...", unless a file or folder is called like that.
bool IsOnServer(const std::string& target);

// The newest colorize_scene job of the scene that has succeeded. Throws RpcError without such a
// scene, Error{kFailedPrecondition} that says what to do when it has no such job.
v1::Job NewestResult(Connection& connection, const std::string& scene);

// The job whose model a folder of results ("color3d colorize -o"), jobs/ID or scenes/ID stands for.
// A folder's is known by the digest of its model. Throws Error: kNotFound without such a folder;
// kFailedPrecondition when there is no model, or the server knows none like it.
v1::Job FindColoredScene(Connection& connection, const std::string& target);

}  // namespace color3d::client
