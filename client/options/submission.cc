#include "client/options/submission.h"

#include <google/protobuf/util/time_util.h>

#include <charconv>
#include <string_view>

#include "core/base/error.h"

namespace color3d::client {
namespace {
using google::protobuf::util::TimeUtil;

constexpr char kHelp[] =
    "Time by which the result is needed: 2026-01-31T18:00:00Z, or from now 90m, 12h or 2d. Of the "
    "waiting jobs of a project with equal priority, the earliest deadline starts first";

// Seconds of "90m", "12h" or "2d"; nothing for other texts.
std::optional<int64_t> SecondsFromNow(std::string_view text) {
  constexpr int64_t kMostUnits = 100'000;
  if (text.empty()) return std::nullopt;
  const int64_t unit = text.back() == 'm'   ? 60
                       : text.back() == 'h' ? 3600
                       : text.back() == 'd' ? 86'400
                                            : 0;
  const std::string_view number = text.substr(0, text.size() - 1);
  int64_t count = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), count);
  const bool is_whole = error == std::errc() && end == number.data() + number.size();
  if (unit == 0 || !is_whole || count < 1 || count > kMostUnits) return std::nullopt;
  return count * unit;
}

}  // namespace

google::protobuf::Timestamp ParseDeadline(const std::string& text) {
  if (const auto seconds = SecondsFromNow(text)) {
    return TimeUtil::GetCurrentTime() + TimeUtil::SecondsToDuration(*seconds);
  }
  google::protobuf::Timestamp time;
  if (!TimeUtil::FromString(text, &time) || time.seconds() <= 0) {
    throw InvalidArgument(
        "--deadline {}: give a time as 2026-01-31T18:00:00Z (RFC 3339), or from now as 90m, 12h or "
        "2d",
        text);
  }
  return time;
}

void AddSubmissionFlags(CLI::App& app, Submission* submission) {
  app.add_option("--notify",
                 submission->notify,
                 "URL to notify when the job has ended; must be allowed by the server's operator");
  app.add_option("--priority", submission->priority, "Lower values start first (default: 100)")
      ->check(CLI::Range(0, 1000));
  app.add_option("--deadline", submission->deadline, kHelp)->check([](const std::string& text) {
    try {
      ParseDeadline(text);
      return std::string();
    } catch (const Error& e) {
      return std::string(e.what());
    }
  });
}

}  // namespace color3d::client
