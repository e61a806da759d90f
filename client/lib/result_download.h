// Downloads several files into a folder of the user. Not thread-safe.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "client/lib/connection.h"
#include "core/base/digest.h"

namespace color3d::client {

struct ResultFile {
  std::string name;  // relative path, as sent by the server
  FileDigest digest;
};

// Writes the files to out/NAME, in order, each atomically. Files that are already there are kept.
// `go_on`: the remedy after a lost connection, completing "when it is back, ...". Throws as
// SafePathBelow and DownloadBlob; Error{kUnavailable} with the number of complete files and the
// remedy if the connection is lost.
void DownloadBelow(Connection& connection,
                   const std::vector<ResultFile>& files,
                   const std::filesystem::path& out,
                   const std::function<void(int64_t received_bytes, int64_t total_bytes)>& progress,
                   const std::string& go_on);

}  // namespace color3d::client
