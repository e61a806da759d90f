#include "client/lib/progress_display.h"

#include <fmt/core.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>

#include "client/lib/job_watch.h"
#include "client/lib/text.h"
#include "core/base/error.h"
#include "core/base/text/utf8.h"
#include "core/catalogue/stages.h"

namespace color3d::client {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::milliseconds kRedraw{100};
constexpr std::chrono::seconds kPlainInterval{10};
// Time in which a worker takes the next stage.
constexpr std::chrono::seconds kIdle{5};

}  // namespace

ProgressDisplay::ProgressDisplay(bool quiet)
    : quiet_(quiet),
      terminal_(::isatty(STDERR_FILENO) == 1),
      last_(steady_clock::now()),
      idle_since_(last_) {}

ProgressDisplay::~ProgressDisplay() { Clear(); }

int ProgressDisplay::Width() const {
  winsize size{};
  if (!terminal_) return 200;
  if (::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col < 20) return 79;
  return size.ws_col - 1;
}

void ProgressDisplay::OnEvent(const v1::JobEvent& event) {
  const v1::Job& job = event.job();
  estimate_.OnJob(job);
  const std::string estimate = estimate_.Text();
  if (IsFinished(job.state())) {
    bool& ended = ended_[job.name()];
    // The failure of the last stage repeats one that was printed before.
    const bool failed = job.state() == v1::Job::STATE_FAILED;
    const bool repeated = failed && failure_told_ && job.kind() == kind::kColorizeScene;
    if (!ended && !repeated) {
      const bool is_new = estimate != told_estimate_;
      PrintLine(EndLine(job) + (is_new && !estimate.empty() ? "; " + estimate : ""));
      told_estimate_ = estimate;
    }
    failure_told_ = failure_told_ || failed;
    ended = true;
    if (unfinished_.erase(job.name()) > 0) idle_since_ = steady_clock::now();
    return;
  }
  ended_.erase(job.name());
  unfinished_[job.name()] = job.state();
  if (job.state() == v1::Job::STATE_RUNNING) Draw(ProgressLine(job, Width(), estimate));
}

bool ProgressDisplay::IsAnyStageRunning() const {
  return std::ranges::any_of(unfinished_,
                             [](const auto& job) { return job.second == v1::Job::STATE_RUNNING; });
}

void ProgressDisplay::OnTick(const std::function<v1::Job()>& look) {
  const auto now = steady_clock::now();
  if (unfinished_.empty() || IsAnyStageRunning() || now - idle_since_ < kIdle) return;
  if (now - last_look_ >= kIdle) {
    last_look_ = now;
    try {
      const v1::Job job = look();
      if (!job.waits_for().empty()) {
        waits_for_ = job.waits_for();
      } else if (job.queue_position() > 0) {
        waits_for_ = fmt::format("its turn, at place {} in the queue", job.queue_position());
      }
    } catch (const Error&) {  // the watch reports an unreachable server
    }
  }
  Draw(fmt::format("waiting for {} ({} stages to go)", waits_for_, unfinished_.size()));
}

void ProgressDisplay::OnTransfer(const std::string& what, int64_t done, int64_t total) {
  if (total > 0) Draw(fmt::format("{} {} of {}", what, HumanBytes(done), HumanBytes(total)));
}

void ProgressDisplay::OnCount(const std::string& what, int64_t done, int64_t total) {
  if (total > 0) Draw(fmt::format("{} {} of {}", what, done, total));
}

void ProgressDisplay::PrintLine(const std::string& line) {
  if (quiet_) return;
  Clear();
  std::cerr << EscapeControls(line) << std::endl;
  last_ = steady_clock::now();
}

void ProgressDisplay::Draw(const std::string& line) {
  const auto interval = terminal_ ? steady_clock::duration(kRedraw) : kPlainInterval;
  if (quiet_ || steady_clock::now() - last_ < interval) return;
  last_ = steady_clock::now();
  if (!terminal_) {
    std::cerr << EscapeControls(line) << std::endl;
    return;
  }
  std::cerr << "\r\033[K" << EscapeControls(line) << std::flush;
  drawn_ = true;
}

void ProgressDisplay::Clear() {
  if (drawn_) std::cerr << "\r\033[K" << std::flush;
  drawn_ = false;
}

}  // namespace color3d::client
