// Proxy of a PostgreSQL socket that cuts connections in the middle of a commit: before the server
// gets it, after the server has answered, or between.
#pragma once

#include <atomic>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace color3d::testing {

class CommitCutter {
 public:
  // Serves `folder`/.s.PGSQL.5432. Of the commits, numbered from 1, cuts each multiple of `every`.
  CommitCutter(const std::filesystem::path& folder, std::filesystem::path server, int every);
  ~CommitCutter();
  CommitCutter(const CommitCutter&) = delete;
  CommitCutter& operator=(const CommitCutter&) = delete;

  // Number of commits that were cut before, after and during the server's work.
  int before() const { return before_; }
  int after() const { return after_; }
  int during() const { return during_; }

 private:
  enum class Cut { kNone, kBefore, kAfter, kDuring };
  void Accept();
  void Carry(int client);
  Cut Next();

  const std::filesystem::path server_;
  const int every_;
  int listener_ = -1;
  std::atomic<bool> stopping_{false};
  std::atomic<int> commits_{0}, before_{0}, after_{0}, during_{0};
  std::mutex mutex_;
  std::vector<std::thread> carriers_;
  std::thread acceptor_;
};

}  // namespace color3d::testing
