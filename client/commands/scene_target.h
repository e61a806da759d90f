// Finds the scene that a user names: a folder of photos, a film or a splat on this machine, or a
// scene on the server.
#pragma once

#include <string>

#include "client/commands/command.h"
#include "client/lib/photos/photo_folder.h"
#include "client/lib/progress_display.h"

namespace color3d::client {

// Uploads the files that the server does not have. Returns "scenes/...".
std::string UploadFolder(Connection& connection,
                         const Context& context,
                         const PhotoFolder& folder,
                         ProgressDisplay& display);

// `text`: "scenes/...", or a folder, splat or film to upload. `film`: the pictures of the folder
// are frames of a film (UsePhotosAsFrames). Throws Error: kNotFound if `text` is none of these,
// kInvalidArgument for a scene on the server with `film`.
std::string ResolveScene(Connection& connection,
                         const Context& context,
                         const std::string& text,
                         bool film,
                         ProgressDisplay& display);

}  // namespace color3d::client
