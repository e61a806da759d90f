// Sends the log lines of jobs to the server, so that its clients can read them. Lines wait in
// memory while the server does not answer; beyond a limit the oldest are dropped. Thread-safe.
#pragma once

#include <deque>
#include <string>
#include <thread>
#include <utility>

#include "core/base/mutex.h"
#include "server/worker/remote/worker_link.h"

namespace color3d {

class LogSender {
 public:
  // The link must outlive this object.
  explicit LogSender(WorkerLink& link);
  // Tries once to send the waiting lines.
  ~LogSender();
  LogSender(const LogSender&) = delete;
  LogSender& operator=(const LogSender&) = delete;

  // Never blocks and never logs. `job`: "jobs/...".
  void Add(const std::string& job, const std::string& line);

 private:
  void Loop();
  // Returns false if the server did not take them.
  bool Send(const std::deque<std::pair<std::string, std::string>>& lines);

  WorkerLink& link_;
  Mutex mutex_;
  CondVar wake_;
  std::deque<std::pair<std::string, std::string>> waiting_ COLOR3D_GUARDED_BY(mutex_);
  bool ending_ COLOR3D_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace color3d
