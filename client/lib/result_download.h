// Several files from the server into a folder of the user's. Not thread-safe.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "client/lib/connection.h"
#include "core/base/digest.h"

namespace color3d::client {

struct ResultFile {
  std::string name;  // a relative path, as the server says it
  FileDigest digest;
};

// Writes them to out/NAME, in order, each whole or not at all; those that are there already are
// kept. `go_on` completes "when the server is back, ...". Throws what SafePathBelow and
// DownloadBlob throw; when the server is gone, Error{kUnavailable} that says how many files are
// there and how to go on.
void DownloadBelow(Connection& connection,
                   const std::vector<ResultFile>& files,
                   const std::filesystem::path& out,
                   const std::function<void(int64_t received_bytes, int64_t total_bytes)>& progress,
                   const std::string& go_on);

}  // namespace color3d::client
