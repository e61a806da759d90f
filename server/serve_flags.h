// Flags of `color3d-server serve`, and those that other commands share with it.
#pragma once

#include <CLI/CLI.hpp>

#include "server/blob_place.h"
#include "server/serve.h"

namespace color3d {

// Adds the flags of the object store. `options` must outlive the command.
void AddBlobPlaceFlags(CLI::App* command, BlobPlaceOptions* options);

// `options` must outlive the command.
void AddServeFlags(CLI::App* serve, ServeOptions* options);

// Takes from the environment what no flag has set. Requires: the command line is parsed.
void CompleteFromEnvironment(ServeOptions* options);

}  // namespace color3d
