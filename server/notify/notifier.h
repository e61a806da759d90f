// Sends notifications about finished jobs to the addresses given by their submitters. Pending
// notifications are in the store, so that they survive a restart; outcomes are kept in memory until
// the store accepts them, so that a full disk causes no duplicates. A slow or absent receiver does
// not delay others.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/base/mutex.h"
#include "server/store/chore_store.h"

namespace color3d {

struct NotifierOptions {
  // See CheckNotifyUrl; may have changed since the job was accepted.
  std::vector<std::string> allowed;
  std::string secret;  // bytes
  std::chrono::milliseconds poll{1'000};
  // Pauses before each further try; the last one repeats.
  std::vector<std::chrono::milliseconds> pauses = {std::chrono::seconds(5),
                                                   std::chrono::seconds(30),
                                                   std::chrono::minutes(2),
                                                   std::chrono::minutes(10),
                                                   std::chrono::minutes(30)};
  int max_tries = 52;  // one day with these pauses
  int at_once = 8;     // of all receivers together
  int at_once_to_one = 2;
  // Pause of all notifications to a receiver that did not answer; doubles each time, up to 16
  // times.
  std::chrono::milliseconds silence{10'000};
  // Pause before the store is asked again to accept outcomes.
  std::chrono::milliseconds store_pause{5'000};
  // Returns true if this server, of all servers on the store, sends.
  std::function<bool()> sends = [] { return true; };
};

// {"type": "job.succeeded", "timestamp": ..., "data": {"name": "jobs/...", ...}}.
std::string NotificationBody(const JobRecord& job);

class Notifier {
 public:
  // The store must outlive this object.
  Notifier(ChoreStore& store, const Clock& clock, NotifierOptions options);
  // Aborts deliveries under way; they are repeated after a restart.
  ~Notifier();
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

 private:
  using Steady = std::chrono::steady_clock;
  // One end of a job: a retried job has another.
  using Key = std::pair<int64_t, int64_t>;  // job, time of its end
  // Outcome of a delivery that the store has not accepted yet.
  struct Outcome {
    bool ended = false;  // delivered or given up; false: to be retried
    int tries = 0;       // including those that the store knows of
    Steady::time_point again;
    bool written = false;
  };
  struct Receiver {
    int sending = 0;
    int silences = 0;  // consecutive
    Steady::time_point again;
  };

  void Loop();
  std::optional<Notification> NextDue() COLOR3D_REQUIRES(mutex_);
  std::optional<Notification> FindDue(const std::vector<Notification>& due)
      COLOR3D_REQUIRES(mutex_);
  void Deliver(const Notification& due);
  std::chrono::milliseconds PauseAfter(int tries) const;
  void RecordAnswer(const std::string& url, bool answered);
  void RecordOutcome(const Notification& due, const Outcome& outcome);
  // Stores the outcome. Returns false if the store does not accept it.
  bool Write(const Key& key, const Outcome& outcome);
  void StoreOutcomes();

  ChoreStore& store_;
  const Clock clock_;
  const NotifierOptions options_;
  Mutex mutex_;
  CondVar wake_;
  std::atomic<bool> stopping_{false};
  std::vector<Notification> due_ COLOR3D_GUARDED_BY(mutex_);  // from the store, at the last poll
  Steady::time_point next_poll_ COLOR3D_GUARDED_BY(mutex_){};
  Steady::time_point next_write_ COLOR3D_GUARDED_BY(mutex_){};
  std::set<Key> under_way_ COLOR3D_GUARDED_BY(mutex_);
  std::map<Key, Outcome> remembered_ COLOR3D_GUARDED_BY(mutex_);
  std::map<std::string, Receiver> receivers_ COLOR3D_GUARDED_BY(mutex_);
  std::vector<std::thread> threads_;
};

}  // namespace color3d
