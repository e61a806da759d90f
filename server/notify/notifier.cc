#include "server/notify/notifier.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/error.h"
#include "core/base/utf8.h"
#include "server/access/notify_targets.h"
#include "server/notify/webhook.h"
#include "server/ops/log_time.h"

namespace color3d {
namespace {

constexpr int kGone = 410;  // the receiver wants to hear no more

std::string TimeText(int64_t ms) {
  return LogTime(std::chrono::system_clock::time_point(std::chrono::milliseconds(ms)));
}

// What a query holds may be a secret.
std::string ForLog(const std::string& url) { return url.substr(0, url.find('?')); }

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

Notifier::Notifier(JobStore& store, const Clock& clock, NotifierOptions options)
    : store_(store), clock_(clock), options_(std::move(options)) {
  for (int i = 0; i < options_.at_once; ++i) threads_.emplace_back([this] { Loop(); });
}

Notifier::~Notifier() {
  {
    std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void Notifier::Loop() {
  while (true) {
    std::optional<Notification> due;
    try {
      due = TakeDue();
      if (due) Deliver(*due);
    } catch (const std::exception& e) {
      spdlog::warn("cannot look after notifications: {}", e.what());
    }
    std::unique_lock lock(mutex_);
    if (due) under_way_.erase(due->job_id);
    if (stopping_) return;
    if (due) continue;
    if (wake_.wait_for(lock, options_.poll, [this] { return stopping_.load(); })) return;
  }
}

// One that no other thread is sending.
std::optional<Notification> Notifier::TakeDue() {
  std::lock_guard lock(mutex_);
  for (const Notification& due : store_.DueNotifications(options_.at_once + 1)) {
    if (under_way_.insert(due.job_id).second) return due;
  }
  return std::nullopt;
}

void Notifier::Deliver(const Notification& due) {
  const JobRecord job = store_.GetJob(due.job);
  WebhookAnswer answer;
  try {
    CheckNotifyUrl(due.url, options_.allowed);
    const WebhookMessage message{due.url,
                                 fmt::format("{}-{}", due.job.substr(5), due.first_ms),
                                 clock_() / 1000,
                                 NotificationBody(job)};
    answer = SendWebhook(message, options_.secret, stopping_);
  } catch (const Error& e) {
    answer.problem = e.what();
  }
  if (stopping_ && answer.status == 0) return;
  const bool delivered = answer.status >= 200 && answer.status < 300;
  const std::string how =
      answer.status != 0 ? fmt::format("HTTP status {}", answer.status) : answer.problem;
  if (delivered || answer.status == kGone || due.tries + 1 >= options_.max_tries) {
    store_.EndNotification(due.job_id);
    spdlog::log(delivered ? spdlog::level::info : spdlog::level::warn,
                "[job={}] word of its end {} {} ({})",
                due.job,
                delivered ? "was sent to" : "is not sent any more to",
                ForLog(due.url),
                how);
    return;
  }
  const size_t next = std::min(static_cast<size_t>(due.tries), options_.pauses.size() - 1);
  store_.DelayNotification(due.job_id, options_.pauses[next].count());
  spdlog::warn("[job={}] word of its end was not taken by {} ({}); again in {} s",
               due.job,
               ForLog(due.url),
               how,
               options_.pauses[next].count() / 1000);
}

}  // namespace color3d
