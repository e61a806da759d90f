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

// `text`: "scenes/...", or a folder or splat, which is uploaded. Throws Error{kNotFound} when it is
// neither.
std::string ResolveScene(Connection& connection,
                         const Context& context,
                         const std::string& text,
                         ProgressDisplay& display);

}  // namespace color3d::client
