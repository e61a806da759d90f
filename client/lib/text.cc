#include "client/lib/text.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "core/base/text/utf8.h"
#include "core/catalogue/stages.h"

namespace color3d::client {
namespace {

constexpr size_t kNameColumns = 21;
constexpr int kBarColumns = 20;

std::string Padded(std::string text, size_t columns) {
  if (text.size() < columns) text.append(columns - text.size(), ' ');
  return text;
}

// Control characters of a message would break the redrawn line.
std::string OneLine(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < 32; }, ' ');
  return text;
}

// Never splits a UTF-8 sequence.
std::string Cut(std::string text, size_t bytes) {
  if (text.size() <= bytes) return text;
  while (bytes > 0 && (static_cast<unsigned char>(text[bytes]) & 0xc0u) == 0x80u) --bytes;
  return text.substr(0, bytes);
}

std::string Bar(const v1::Progress& progress) {
  const double part = static_cast<double>(progress.step()) / progress.total_steps();
  const int filled = static_cast<int>(std::clamp(part, 0.0, 1.0) * kBarColumns);
  return fmt::format("[{}{}] {}/{}",
                     std::string(filled, '#'),
                     std::string(kBarColumns - filled, '-'),
                     progress.step(),
                     progress.total_steps());
}

// The server repeats the whole error in every stage that depends on the failed one.
std::string ShortSkipReason(const std::string& reason) {
  const size_t failed = reason.find(" failed: ");
  const bool of_input = reason.starts_with("input jobs/") && failed != std::string::npos;
  return OneLine(of_input ? reason.substr(0, failed) + " failed" : reason);
}

double SecondsOf(const v1::Job& job) {
  if (job.progress().seconds() > 0.0 || !job.has_start_time() || !job.has_end_time()) {
    return job.progress().seconds();
  }
  return static_cast<double>(job.end_time().seconds() - job.start_time().seconds()) +
         1e-9 * (job.end_time().nanos() - job.start_time().nanos());
}

}  // namespace

std::string HumanBytes(int64_t bytes) {
  if (bytes < 1000) return fmt::format("{} B", bytes);
  double value = static_cast<double>(bytes);
  const char* unit = "";
  for (const char* next : {"kB", "MB", "GB", "TB"}) {
    if (value < 999.95) break;
    value /= 1000.0;
    unit = next;
  }
  return fmt::format("{:.1f} {}", value, unit);
}

std::string HumanSeconds(double seconds) {
  if (seconds < 9.95) return fmt::format("{:.1f} s", std::max(0.0, seconds));
  const int64_t whole = std::llround(seconds);
  if (whole < 600) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min", whole / 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

std::string HumanClock(double seconds) {
  const int64_t whole = std::llround(std::clamp(seconds, 0.0, 1e8));
  const int64_t s = whole % 60;
  const int64_t m = whole / 60 % 60;
  if (whole < 3600) return fmt::format("{}:{:02}", m, s);
  return fmt::format("{}:{:02}:{:02}", whole / 3600, m, s);
}

std::string HumanTime(const google::protobuf::Timestamp& time) {
  if (time.seconds() == 0) return "-";
  const std::time_t seconds = time.seconds();
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[32];
  std::strftime(text, sizeof(text), "%Y-%m-%d %H:%M:%S", &utc);
  return text;
}

std::string StateName(v1::Job::State state) {
  const std::string name = v1::Job::State_Name(state);
  return name.starts_with("STATE_") ? name.substr(6) : "UNKNOWN";
}

std::string StageName(const v1::Job& job) {
  return job.kind() == kind::kColorizeScene ? "report" : job.kind();
}

std::string ProgressLine(const v1::Job& job, int width, const std::string& note) {
  const v1::Progress& progress = job.progress();
  std::string line = Padded(StageName(job), kNameColumns) + " ";
  if (progress.total_steps() > 0) {
    line += Bar(progress);
  } else if (progress.step() > 0) {
    line += fmt::format("{}", progress.step());
  }
  if (!progress.error_name().empty()) {
    line += fmt::format("  {}={:.4g}", OneLine(progress.error_name()), progress.error_value());
  }
  if (progress.eta_seconds() >= 0.0 && progress.step() > 0) {
    line += "  " + HumanClock(progress.eta_seconds()) + " left";
  }
  if (!note.empty()) line += "  " + note;
  if (!progress.message().empty()) line += "  " + OneLine(progress.message());
  return Cut(line, static_cast<size_t>(std::max(10, width)));
}

std::string EndLine(const v1::Job& job) {
  const std::string name = Padded(StageName(job), kNameColumns) + " ";
  const std::string seconds = HumanSeconds(SecondsOf(job));
  switch (job.state()) {
    case v1::Job::STATE_SUCCEEDED:
      return name + (job.cached() ? "done (cached)" : "done in " + seconds);
    case v1::Job::STATE_SKIPPED:
      return name + "left out: " + ShortSkipReason(job.skip_reason());
    case v1::Job::STATE_FAILED:
      return name + "failed after " + seconds + ": " + OneLine(job.error().message());
    case v1::Job::STATE_CANCELLED:
      return name + (job.has_start_time() ? "cancelled after " + seconds : "cancelled");
    default:
      return name + StateName(job.state());
  }
}

std::string ShellLine(const std::vector<std::string>& arguments) {
  constexpr char kPlain[] =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./:=@%+,";
  std::string line;
  for (const std::string& argument : arguments) {
    if (!line.empty()) line += ' ';
    if (!argument.empty() && argument.find_first_not_of(kPlain) == std::string::npos) {
      line += argument;
      continue;
    }
    line += '\'';
    for (const char c : argument) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += '\'';
  }
  return line;
}

std::string Table(std::vector<std::vector<std::string>> rows) {
  std::vector<size_t> widths;
  for (auto& row : rows) {
    for (std::string& cell : row) cell = EscapeControls(cell);
  }
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()), 0);
    for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (size_t i = 0; i < row.size(); ++i) {
      line += i + 1 < row.size() ? Padded(row[i], widths[i] + 2) : row[i];
    }
    text += line + "\n";
  }
  return text;
}

}  // namespace color3d::client
