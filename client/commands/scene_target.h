// What a user names as a scene: a folder of photos or a splat on this machine, or a scene that the
// server holds.
#pragma once

#include <string>

#include "client/commands/command.h"
#include "client/lib/photos/photo_folder.h"
#include "client/lib/progress_display.h"

namespace color3d::client {

// Uploads the photos, unless the server has them, and returns "scenes/...".
std::string UploadFolder(Connection& connection,
                         const Context& context,
                         const PhotoFolder& folder,
                         ProgressDisplay& display);

// `text`: "scenes/...", or a folder, splat or film, which is uploaded; `film`: the folder's
// pictures are frames of a film (TakeAsFrames). Throws Error{kNotFound} when it is none of them,
// Error{kInvalidArgument} for a scene of the server's with `film`.
std::string ResolveScene(Connection& connection,
                         const Context& context,
                         const std::string& text,
                         bool film,
                         ProgressDisplay& display);

}  // namespace color3d::client
