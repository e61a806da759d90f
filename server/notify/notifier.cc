#include "server/notify/notifier.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "core/base/error.h"
#include "core/base/text/utf8.h"
#include "server/access/notify_targets.h"
#include "server/notify/webhook.h"
#include "server/ops/log_time.h"

namespace color3d {
namespace {

constexpr int kGone = 410;  // HTTP 410: the receiver wants no more notifications
constexpr int kOfEachReceiver = 50;

std::string TimeText(int64_t ms) {
  return LogTime(std::chrono::system_clock::time_point(std::chrono::milliseconds(ms)));
}

// Returns scheme, host and port.
std::string ReceiverAddress(const std::string& url) { return url.substr(0, url.find('/', 8)); }

std::pair<int64_t, int64_t> NotificationKey(const Notification& due) {
  return {due.job_id, due.first_ms};
}

// A query may hold a secret.
std::string WithoutQuery(const std::string& url) { return url.substr(0, url.find('?')); }

}  // namespace

std::string NotificationBody(const JobRecord& job) {
  const char* type = job.state == JobState::kSucceeded   ? "job.succeeded"
                     : job.state == JobState::kCancelled ? "job.cancelled"
                                                         : "job.failed";
  nlohmann::ordered_json data = {{"name", job.name},
                                 {"kind", job.kind},
                                 {"scene", PublicScene(job.scene)},
                                 {"project", job.project},
                                 {"state", JobStateName(job.state)},
                                 {"create_time", TimeText(job.create_ms)},
                                 {"end_time", TimeText(job.end_ms)},
                                 {"artifacts", job.artifacts.size()}};
  if (job.error) {
    data["error"] = {{"reason", job.error->reason}, {"message", CleanUtf8(job.error->message)}};
  }
  const nlohmann::ordered_json body = {
      {"type", type}, {"timestamp", TimeText(job.end_ms)}, {"data", data}};
  return body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Notifier::Notifier(ChoreStore& store, const Clock& clock, NotifierOptions options)
    : store_(store), clock_(clock), options_(std::move(options)) {
  for (int i = 0; i < options_.at_once; ++i) threads_.emplace_back([this] { Loop(); });
}

Notifier::~Notifier() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  wake_.NotifyAll();
  for (std::thread& thread : threads_) thread.join();
}

void Notifier::Loop() {
  while (true) {
    std::optional<Notification> due;
    try {
      StoreOutcomes();
      {
        const MutexLock lock(mutex_);
        due = NextDue();
      }
      if (due) Deliver(*due);
    } catch (const std::exception& e) {
      spdlog::warn("cannot process notifications: {}", e.what());
    }
    MutexLock lock(mutex_);
    if (due) {
      under_way_.erase(NotificationKey(*due));
      --receivers_[ReceiverAddress(due->url)].sending;
    }
    if (stopping_) return;
    if (due) continue;
    const auto end = Steady::now() + options_.poll;
    while (!stopping_ && wake_.WaitUntil(mutex_, end)) continue;
    if (stopping_) return;
  }
}

// Returns a notification that may be sent now. Reads the store when its last list is used up, at
// each poll.
std::optional<Notification> Notifier::NextDue() {
  if (auto next = FindDue(due_)) return next;
  const auto now = Steady::now();
  if (now < next_poll_) return std::nullopt;
  next_poll_ = now + options_.poll;
  due_ = options_.sends() ? store_.DueNotifications(kOfEachReceiver) : std::vector<Notification>();
  std::set<Key> owed;
  for (const Notification& due : due_) owed.insert(NotificationKey(due));
  // Forgets notifications that the store no longer owes, unless their outcome is not stored yet.
  std::erase_if(remembered_, [&](const auto& entry) {
    return !owed.contains(entry.first) && (entry.second.written || !entry.second.ended);
  });
  std::erase_if(receivers_, [&](const auto& entry) {
    const Receiver& receiver = entry.second;
    return receiver.sending == 0 && now > receiver.again + std::chrono::hours(1);
  });
  return FindDue(due_);
}

std::optional<Notification> Notifier::FindDue(const std::vector<Notification>& all) {
  const auto now = Steady::now();
  for (const Notification& due : all) {
    if (under_way_.contains(NotificationKey(due))) continue;
    const auto known = remembered_.find(NotificationKey(due));
    if (known != remembered_.end() && (known->second.ended || now < known->second.again)) continue;
    Receiver& receiver = receivers_[ReceiverAddress(due.url)];
    const int most = receiver.silences > 0 ? 1 : options_.at_once_to_one;
    if (receiver.sending >= most || now < receiver.again) continue;
    ++receiver.sending;
    under_way_.insert(NotificationKey(due));
    Notification next = due;
    if (known != remembered_.end()) next.tries = known->second.tries;
    return next;
  }
  return std::nullopt;
}

void Notifier::Deliver(const Notification& due) {
  WebhookAnswer answer;
  try {
    const JobRecord job = store_.GetJob(due.job);
    CheckNotifyUrl(due.url, options_.allowed);
    const WebhookMessage message{due.url,
                                 fmt::format("{}-{}", due.job.substr(5), due.first_ms),
                                 clock_() / 1000,
                                 NotificationBody(job)};
    answer = SendWebhook(message, options_.secret, stopping_);
    if (stopping_ && answer.status == 0) return;
    RecordAnswer(due.url, answer.status != 0);
  } catch (const Error& e) {
    answer.problem = e.what();
  }
  const bool delivered = answer.status >= 200 && answer.status < 300;
  const std::string how =
      answer.status != 0 ? fmt::format("HTTP status {}", answer.status) : answer.problem;
  if (delivered || answer.status == kGone || due.tries + 1 >= options_.max_tries) {
    spdlog::log(delivered ? spdlog::level::info : spdlog::level::warn,
                "[job={}] notification {} {} ({})",
                due.job,
                delivered ? "was sent to" : "is given up for",
                WithoutQuery(due.url),
                how);
    return RecordOutcome(due, {true, due.tries + 1, {}});
  }
  const std::chrono::milliseconds pause = PauseAfter(due.tries);
  spdlog::warn("[job={}] notification was not accepted by {} ({}); retry in {} s",
               due.job,
               WithoutQuery(due.url),
               how,
               pause.count() / 1000);
  RecordOutcome(due, {false, due.tries + 1, Steady::now() + pause});
}

std::chrono::milliseconds Notifier::PauseAfter(int tries) const {
  return options_.pauses[std::min(static_cast<size_t>(tries), options_.pauses.size() - 1)];
}

void Notifier::RecordAnswer(const std::string& url, bool answered) {
  const MutexLock lock(mutex_);
  Receiver& receiver = receivers_[ReceiverAddress(url)];
  if (answered) {
    receiver.silences = 0;
    return;
  }
  receiver.again = Steady::now() + options_.silence * (1 << std::min(receiver.silences, 4));
  ++receiver.silences;
}

void Notifier::RecordOutcome(const Notification& due, const Outcome& outcome) {
  {
    // Recorded before the store, so that it is not sent again if that fails.
    const MutexLock lock(mutex_);
    remembered_[NotificationKey(due)] = outcome;
  }
  Write(NotificationKey(due), outcome);
}

bool Notifier::Write(const Key& key, const Outcome& outcome) {
  const auto& [job_id, first_ms] = key;
  try {
    if (outcome.ended) {
      store_.EndNotification(job_id, first_ms);
    } else {
      store_.DelayNotification(job_id, first_ms, PauseAfter(outcome.tries - 1).count());
    }
    const MutexLock lock(mutex_);
    if (const auto known = remembered_.find(key); known != remembered_.end()) {
      known->second.written = true;
    }
    return true;
  } catch (const Error& e) {
    const MutexLock lock(mutex_);
    next_write_ = Steady::now() + options_.store_pause;
    spdlog::warn("the outcome of a notification cannot be stored and is kept in memory: {}",
                 e.what());
    return false;
  }
}

// Failed attempts are stored after their next try.
void Notifier::StoreOutcomes() {
  std::vector<std::pair<Key, Outcome>> unwritten;
  {
    const MutexLock lock(mutex_);
    if (Steady::now() < next_write_) return;
    for (const auto& [key, outcome] : remembered_) {
      if (outcome.ended && !outcome.written && !under_way_.contains(key)) {
        unwritten.emplace_back(key, outcome);
      }
    }
    if (!unwritten.empty()) next_write_ = Steady::now() + options_.store_pause;
  }
  for (const auto& [key, outcome] : unwritten) {
    if (!Write(key, outcome)) return;
  }
}

}  // namespace color3d
