// Sends word of jobs that have ended to whom their submitters named. What is owed stands in the
// store, so that it outlives the server; what was done about it is remembered until the store has
// taken it, so that a full disk sends nothing twice. A receiver that is slow or gone keeps no other
// one waiting.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
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
  int at_once = 8;     // of all receivers
  int at_once_to_one = 2;
  // Of all to a receiver that did not answer; doubles with each further time, up to 16 times.
  std::chrono::milliseconds silence{10'000};
  // Before the store is asked again to take what it did not.
  std::chrono::milliseconds store_pause{5'000};
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
  using Steady = std::chrono::steady_clock;
  // One end of a job: a job that is retried has another.
  using Key = std::pair<int64_t, int64_t>;  // job, when it ended
  // What the store has not taken yet.
  struct Outcome {
    bool ended = false;  // delivered or given up; else it is tried again
    int tries = 0;       // with those that the store knows of
    Steady::time_point again;
    bool written = false;
  };
  struct Receiver {
    int sending = 0;
    int silences = 0;  // one after the other
    Steady::time_point again;
  };

  void Loop();
  // With the mutex held.
  std::optional<Notification> TakeDue();
  std::optional<Notification> NextOf(const std::vector<Notification>& due);
  void Deliver(const Notification& due);
  std::chrono::milliseconds PauseAfter(int tries) const;
  void NoteAnswer(const std::string& url, bool answered);
  void Conclude(const Notification& due, const Outcome& outcome);
  // Tells the store; false where it does not take it.
  bool Write(const Key& key, const Outcome& outcome);
  void WriteRemembered();

  JobStore& store_;
  const Clock clock_;
  const NotifierOptions options_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::atomic<bool> stopping_{false};
  std::vector<Notification> due_;  // as the store said at the last poll
  Steady::time_point next_poll_{}, next_write_{};
  std::set<Key> under_way_;
  std::map<Key, Outcome> remembered_;
  std::map<std::string, Receiver> receivers_;
  std::vector<std::thread> threads_;
};

}  // namespace color3d
