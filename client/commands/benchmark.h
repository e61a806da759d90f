// `color3d colorize --benchmark`: what happens before the colorize_scene job.
#pragma once

#include "client/commands/command.h"
#include "client/lib/connection.h"
#include "client/lib/progress_display.h"
#include "client/options/colorize_options.h"

namespace color3d::client {

// Drops the photos' colour, uploads the grey copies as a scene, selects the key view, and uploads
// the key view's and the held-out views' true colours. Returns the colorize_scene spec that is left
// to submit. Throws Error{kInvalidArgument} when the photos are grey or fewer than 3,
// CommandFailure when a stage fails or the user presses Ctrl-C (what was done is kept by the
// server).
v1::JobSpec PrepareBenchmark(Connection& connection,
                             const Context& context,
                             const ColorizeOptions& options,
                             const PhotoFolder& folder,
                             ProgressDisplay& display);

// Fast check without the server, same errors.
void RequireColorPhotos(const PhotoFolder& folder, const CancellationToken& cancel);

}  // namespace color3d::client
