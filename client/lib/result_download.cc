#include "client/lib/result_download.h"

#include "client/lib/blob_transfer.h"
#include "client/lib/out_folder.h"

namespace color3d::client {

void DownloadBelow(Connection& connection,
                   const std::vector<ResultFile>& files,
                   const std::filesystem::path& out,
                   const std::function<void(int64_t received_bytes, int64_t total_bytes)>& progress,
                   const std::string& go_on) {
  int64_t total = 0, before = 0;
  for (const ResultFile& file : files) total += file.digest.size_bytes;
  for (size_t i = 0; i < files.size(); ++i) {
    const ResultFile& file = files[i];
    const std::filesystem::path path = SafePathBelow(out, file.name);
    try {
      DownloadBlob(connection, file.digest, path, [&](int64_t received) {
        progress(before + received, total);
      });
    } catch (const Error& e) {
      if (e.code() != ErrorCode::kUnavailable) throw;
      throw Error(ErrorCode::kUnavailable,
                  "lost the server at {}: {} of {} files are complete in {}; when it is back, {}",
                  connection.address(),
                  i,
                  files.size(),
                  out.empty() ? "." : out.string(),
                  go_on);
    }
    before += file.digest.size_bytes;
  }
}

}  // namespace color3d::client
