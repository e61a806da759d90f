// Films that are copies of each other, as downloads leave them ("film (1).mp4").
#pragma once

#include <string>
#include <vector>

#include "client/lib/photos/photo_folder.h"

namespace color3d::client {

// Keeps one of files that are equal byte for byte, the one with the shortest name, and adds a note
// for each that is left out. The order stays.
void LeaveOutCopies(std::vector<LocalFile>* films, std::vector<std::string>* notes);

}  // namespace color3d::client
