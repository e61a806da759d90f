// Sends word of jobs that have ended to whom their submitters named. What is owed stands in the
// store, so that it outlives the server.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "server/store/job_store.h"

namespace color3d {

struct NotifierOptions {
  std::vector<std::string> allowed;  // as CheckNotifyUrl; may have changed since the job came
  std::string secret;                // bytes
  std::chrono::milliseconds poll{1'000};
  // Before each further try; the last one repeats.
  std::vector<std::chrono::milliseconds> pauses = {std::chrono::seconds(5),
                                                   std::chrono::seconds(30),
                                                   std::chrono::minutes(2),
                                                   std::chrono::minutes(10),
                                                   std::chrono::minutes(30)};
  int max_tries = 52;  // with these pauses, a day
  int at_once = 4;
};

// {"type": "job.succeeded", "timestamp": ..., "data": {"name": "jobs/...", ...}}.
std::string NotificationBody(const JobRecord& job);

class Notifier {
 public:
  // The store must outlive this object.
  Notifier(JobStore& store, const Clock& clock, NotifierOptions options);
  // Cuts off what is being sent; it is sent again by the next one.
  ~Notifier();
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

 private:
  void Loop();
  std::optional<Notification> TakeDue();
  void Deliver(const Notification& due);

  JobStore& store_;
  const Clock clock_;
  const NotifierOptions options_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::atomic<bool> stopping_{false};
  std::set<int64_t> under_way_;
  std::vector<std::thread> threads_;
};

}  // namespace color3d
