// `color3d colorize --benchmark`: the steps before the colorize_scene job.
#pragma once

#include "client/commands/command.h"
#include "client/lib/connection.h"
#include "client/lib/progress_display.h"
#include "client/options/colorize_options.h"

namespace color3d::client {

// Drops the colour of the photos, uploads the grey copies as a scene, selects the key view, and
// uploads the true colours of the key view and of the held-out views. Returns the colorize_scene
// spec to submit. Throws Error{kInvalidArgument} if the photos are grey or fewer than 3, and
// CommandFailure if a stage fails or the user presses Ctrl-C (the server keeps finished stages).
v1::JobSpec PrepareBenchmark(Connection& connection,
                             const Context& context,
                             const ColorizeOptions& options,
                             const PhotoFolder& folder,
                             ProgressDisplay& display);

// Throws the errors of PrepareBenchmark for grey or too few photos, without a server.
void RequireColorPhotos(const PhotoFolder& folder, const CancellationToken& cancel);

}  // namespace color3d::client
