#include "server/rpc/calls/job_logs.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <fstream>

#include "core/base/error.h"
#include "server/ops/job_log.h"

namespace color3d {
namespace {

class FileJobLogs : public JobLogs {
 public:
  explicit FileJobLogs(std::filesystem::path folder) : folder_(std::move(folder)) {}

  void Append(const std::string& job, const std::string& lines) override {
    // The end of the last line is added by AppendJobLog.
    AppendJobLog(folder_, job, lines.substr(0, lines.find_last_not_of('\n') + 1));
  }
  std::string Read(const std::string& job, int64_t offset, size_t max_bytes) override {
    std::ifstream file(JobLogFile(folder_, job), std::ios::binary);
    std::string bytes(max_bytes, '\0');
    file.seekg(offset);
    file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    bytes.resize(static_cast<size_t>(std::max<std::streamsize>(file.gcount(), 0)));
    return bytes;
  }

 private:
  const std::filesystem::path folder_;
};

class StoredJobLogs : public JobLogs {
 public:
  StoredJobLogs(SharedJobLogs& store, const std::filesystem::path& earlier)
      : store_(store), earlier_(earlier) {}

  void Append(const std::string& job, const std::string& lines) override {
    try {
      store_.AppendJobLog(job, lines);
    } catch (const Error& e) {
      spdlog::warn("lines of the log of {} are lost: {}", job, e.what());
    }
  }
  std::string Read(const std::string& job, int64_t offset, size_t max_bytes) override {
    std::string bytes = store_.ReadJobLog(job, offset, max_bytes);
    const bool has_none = bytes.empty() && store_.ReadJobLog(job, 0, 1).empty();
    return has_none ? earlier_.Read(job, offset, max_bytes) : bytes;
  }

 private:
  SharedJobLogs& store_;
  FileJobLogs earlier_;
};

}  // namespace

std::unique_ptr<JobLogs> MakeFileJobLogs(const std::filesystem::path& folder) {
  return std::make_unique<FileJobLogs>(folder);
}

std::unique_ptr<JobLogs> MakeSharedJobLogs(SharedJobLogs& store,
                                           const std::filesystem::path& earlier) {
  return std::make_unique<StoredJobLogs>(store, earlier);
}

}  // namespace color3d
