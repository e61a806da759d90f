#include "server/store/sqlite_rows.h"

#include <algorithm>

namespace color3d {

JobRecord JobFromRow(const SqliteStatement& row) {
  JobRecord job;
  int c = 0;
  job.id = row.Int(c++);
  job.name = row.Text(c++);
  job.parent = row.Text(c++);
  job.kind = row.Text(c++);
  job.scene = row.Text(c++);
  job.spec = row.Text(c++);
  job.state = JobStateFromName(row.Text(c++));
  job.cancel_requested = row.Int(c++) != 0;
  job.priority = static_cast<int>(row.Int(c++));
  job.attempt = static_cast<int>(row.Int(c++));
  job.max_attempts = static_cast<int>(row.Int(c++));
  job.lease_epoch = row.Int(c++);
  job.progress.step = row.Int(c++);
  job.progress.total_steps = row.Int(c++);
  job.progress.message = row.Text(c++);
  job.progress.error_name = row.Text(c++);
  job.progress.error_value = row.Double(c++);
  job.progress.seconds = row.Double(c++);
  job.progress.eta_seconds = row.Double(c++);
  JobError error;
  error.code = static_cast<ErrorCode>(row.Int(c++));
  error.reason = row.Text(c++);
  error.message = row.Text(c++);
  if (!error.reason.empty()) job.error = error;
  job.skip_reason = row.Text(c++);
  job.skipped_by_plan = row.Int(c++) != 0;
  job.cached = row.Int(c++) != 0;
  job.warnings = SplitLines(row.Text(c++));
  FileDigest checkpoint;
  checkpoint.sha256 = row.Text(c++);
  checkpoint.size_bytes = row.Int(c++);
  if (!checkpoint.sha256.empty()) job.checkpoint = checkpoint;
  job.create_ms = row.Int(c++);
  job.start_ms = row.Int(c++);
  job.end_ms = row.Int(c++);
  job.worker = row.Text(c++);
  job.revision = row.Int(c++);
  job.peak_memory_bytes = row.Int(c++);
  return job;
}

std::string SelectJob(const std::string& tail) {
  return std::string("select ") + kJobColumns + " from job " + tail;
}

std::string JoinLines(const std::vector<std::string>& lines) {
  std::string text;
  for (std::string line : lines) {
    std::replace(line.begin(), line.end(), '\n', ' ');
    if (!text.empty()) text += '\n';
    text += line;
  }
  return text;
}

std::vector<std::string> SplitLines(const std::string& text) {
  std::vector<std::string> lines;
  size_t start = 0;
  while (start < text.size()) {
    size_t end = text.find('\n', start);
    if (end == std::string::npos) end = text.size();
    lines.push_back(text.substr(start, end - start));
    start = end + 1;
  }
  return lines;
}

std::string JoinIds(const std::vector<int64_t>& ids) {
  std::string text;
  for (const int64_t id : ids) {
    if (!text.empty()) text += ',';
    text += std::to_string(id);
  }
  return text;
}

}  // namespace color3d
