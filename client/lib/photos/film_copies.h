// Removes duplicate films, e.g. repeated downloads ("film (1).mp4").
#pragma once

#include <string>
#include <vector>

#include "client/lib/photos/photo_folder.h"

namespace color3d::client {

// Of files that are equal byte for byte, keeps the one with the shortest name and adds a note for
// each other one. Keeps the order.
void RemoveCopies(std::vector<LocalFile>* films, std::vector<std::string>* notes);

}  // namespace color3d::client
