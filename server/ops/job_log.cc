#include "server/ops/job_log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/sinks/base_sink.h>
#include <sys/stat.h>
#include <unistd.h>

#include <memory>
#include <mutex>
#include <string_view>

#include "core/base/text/utf8.h"
#include "server/ops/log_time.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kTag = "[job=jobs/";
constexpr int64_t kMaxBytes = 1 << 20;
constexpr std::string_view kFull = "the log is full; further lines are in the log of the worker\n";

std::string LineOf(const spdlog::details::log_msg& message, std::string_view text) {
  const spdlog::string_view_t level = spdlog::level::to_string_view(message.level);
  return fmt::format("{} {} {}",
                     LogTime(message.time),
                     std::string_view(level.data(), level.size()),
                     EscapeControls(CleanUtf8(text)));
}

class JobLogSink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit JobLogSink(std::function<void(const std::string&, const std::string&)> append)
      : append_(std::move(append)) {}

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::string_view text(message.payload.data(), message.payload.size());
    if (!text.starts_with(kTag)) return;
    const size_t end = text.find_first_of(" ]", kTag.size());
    const size_t close = text.find("] ");
    if (end == std::string_view::npos || close == std::string_view::npos) return;
    append_(std::string(text.substr(5, end - 5)), LineOf(message, text.substr(close + 2)));
  }
  void flush_() override {}

 private:
  const std::function<void(const std::string&, const std::string&)> append_;
};

}  // namespace

fs::path JobLogFile(const fs::path& folder, const std::string& job) {
  return folder / (job.substr(job.find('/') + 1) + ".log");
}

void AppendJobLog(const fs::path& folder, const std::string& job, const std::string& line) {
  const int fd =
      ::open(JobLogFile(folder, job).c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  if (fd < 0) return;
  struct stat status {};
  if (::fstat(fd, &status) == 0 && status.st_size < kMaxBytes) {
    std::string text = line + "\n";
    if (status.st_size + static_cast<int64_t>(text.size()) >= kMaxBytes) text += kFull;
    [[maybe_unused]] const ssize_t written = ::write(fd, text.data(), text.size());
  }
  ::close(fd);
}

spdlog::sink_ptr MakeJobLogSink(
    std::function<void(const std::string& job, const std::string& line)> append) {
  return std::make_shared<JobLogSink>(std::move(append));
}

spdlog::sink_ptr MakeJobLogSink(const fs::path& folder) {
  return MakeJobLogSink([folder](const std::string& job, const std::string& line) {
    AppendJobLog(folder, job, line);
  });
}

}  // namespace color3d
