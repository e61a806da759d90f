// One picture, coloured by the live call.
#pragma once

#include <string>

#include "client/lib/live_coloring.h"

namespace color3d::client {

// Returns the PNG. Throws what the service answers for the picture, and as ColorizeLive.
std::string LivePng(Connection& connection,
                    const LiveSource& source,
                    const LivePicture& picture,
                    int max_side_px);

}  // namespace color3d::client
