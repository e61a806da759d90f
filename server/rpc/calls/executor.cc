#include "server/rpc/calls/executor.h"

#include <utility>

namespace color3d {

Executor::Executor(int threads, size_t max_waiting, int max_of_owner)
    : max_waiting_(max_waiting), max_of_owner_(max_of_owner) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { Loop(); });
}

Executor::~Executor() {
  {
    std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

bool Executor::TryPost(std::function<void()> task, const std::string& owner) {
  {
    std::lock_guard lock(mutex_);
    if (waiting_ >= max_waiting_) return false;
    Add(std::move(task), owner);
  }
  wake_.notify_one();
  return true;
}

void Executor::Post(std::function<void()> task, const std::string& owner) {
  {
    std::lock_guard lock(mutex_);
    Add(std::move(task), owner);
  }
  wake_.notify_one();
}

void Executor::Add(std::function<void()> task, const std::string& owner) {
  Line& line = lines_[owner];
  if (line.waiting.empty()) turns_.push_back(owner);
  line.waiting.push_back(std::move(task));
  ++waiting_;
}

size_t Executor::NextTurn() const {
  size_t turn = 0;
  while (turn < turns_.size() && lines_.at(turns_[turn]).running >= max_of_owner_) ++turn;
  return turn;
}

void Executor::Loop() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return NextTurn() < turns_.size() || (stopping_ && waiting_ == 0); });
    const size_t turn = NextTurn();
    if (turn == turns_.size()) return;
    const std::string owner = turns_[turn];
    turns_.erase(turns_.begin() + static_cast<std::ptrdiff_t>(turn));
    Line& line = lines_[owner];
    std::function<void()> task = std::move(line.waiting.front());
    line.waiting.pop_front();
    --waiting_;
    ++line.running;
    if (!line.waiting.empty()) turns_.push_back(owner);
    lock.unlock();
    task();
    task = nullptr;
    lock.lock();
    const auto done = lines_.find(owner);
    if (--done->second.running == 0 && done->second.waiting.empty()) lines_.erase(done);
    // A task of the same owner may have waited for this one, and whoever stops for the last.
    wake_.notify_all();
  }
}

}  // namespace color3d
