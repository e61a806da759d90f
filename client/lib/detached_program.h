// Starts programs that outlive this one.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace color3d::client {

// Starts arguments[0], which is searched in PATH, in a session of its own, so that it outlives this
// process and its terminal. Its output replaces the file `output`. Returns 0, or the number of the
// system's error.
int StartDetached(const std::vector<std::string>& arguments,
                  const std::filesystem::path& output,
                  pid_t* program);

}  // namespace color3d::client
