#include "client/studio/http_server.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <deque>
#include <functional>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "core/base/mutex.h"

namespace color3d::client {
namespace {
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

constexpr milliseconds kLook{200};  // between two looks at the flag that ends everything
constexpr size_t kLingerBytes = 4 << 20;
constexpr milliseconds kLinger{1000};
constexpr std::string_view kBusy =
    "HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nRetry-After: 1\r\n"
    "Content-Length: 0\r\n\r\n";

// Set while a connection beyond the limit is answered, on the thread that accepts.
thread_local bool is_turned_away = false;

// A connection with time limits for all that it receives and for each write.
class TimedStream : public httplib::Stream {
 public:
  TimedStream(int socket, const HttpLimits& limits, const std::atomic<bool>& stopping)
      : socket_(socket), limits_(limits), stopping_(stopping) {}

  bool is_readable() const override { return begin_ < end_ || Wait(POLLIN, ReadLimit()); }
  bool is_writable() const override {
    return !IsClosed() && Wait(POLLOUT, Steady::now() + limits_.patience);
  }
  ssize_t read(char* to, size_t size) override {
    if (begin_ == end_) {
      if (!Wait(POLLIN, ReadLimit())) return -1;
      const ssize_t received = ::recv(socket_, buffer_.data(), buffer_.size(), 0);
      if (received <= 0) return received;
      received_ += received;
      begin_ = 0;
      end_ = static_cast<size_t>(received);
    }
    const size_t count = std::min(size, end_ - begin_);
    std::copy_n(buffer_.data() + begin_, count, to);
    begin_ += count;
    return static_cast<ssize_t>(count);
  }
  ssize_t write(const char* from, size_t size) override {
    if (!Wait(POLLOUT, Steady::now() + limits_.patience)) return -1;
    return ::send(socket_, from, size, MSG_NOSIGNAL | MSG_DONTWAIT);
  }
  void get_remote_ip_and_port(std::string& ip, int& port) const override {
    ip = "127.0.0.1";
    port = 0;
  }
  void get_local_ip_and_port(std::string& ip, int& port) const override {
    ip = "127.0.0.1";
    port = 0;
  }
  socket_t socket() const override { return socket_; }

 private:
  Steady::time_point ReadLimit() const {
    const std::chrono::duration<double> for_bytes(static_cast<double>(received_) /
                                                  limits_.least_bytes_per_s);
    return start_ + limits_.patience + std::chrono::duration_cast<milliseconds>(for_bytes);
  }
  bool IsClosed() const {
    char next = 0;
    return ::recv(socket_, &next, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
  }
  // Returns false at the time limit, at the end of the server and for a broken connection.
  bool Wait(short events, Steady::time_point end) const {
    while (!stopping_) {
      const auto left = std::chrono::duration_cast<milliseconds>(end - Steady::now());
      if (left.count() <= 0) return false;
      pollfd waiting{socket_, events, 0};
      const int ready = ::poll(&waiting, 1, static_cast<int>(std::min(left, kLook).count()));
      if (ready > 0) return (waiting.revents & (events | POLLHUP)) != 0;
      if (ready < 0 && errno != EINTR) return false;
    }
    return false;
  }

  const int socket_;
  const HttpLimits& limits_;
  const std::atomic<bool>& stopping_;
  const Steady::time_point start_ = Steady::now();
  int64_t received_ = 0;
  std::array<char, 16384> buffer_{};
  size_t begin_ = 0, end_ = 0;
};

// Reads on for a moment after an answer to a request that was not read whole: a connection that is
// closed with bytes left may lose the answer.
void Linger(int socket) {
  ::shutdown(socket, SHUT_WR);
  std::array<char, 16384> ignored{};
  const auto end = Steady::now() + kLinger;
  for (size_t bytes = 0; bytes < kLingerBytes && Steady::now() < end;) {
    pollfd waiting{socket, POLLIN, 0};
    if (::poll(&waiting, 1, 50) == 0) continue;
    const ssize_t received = ::recv(socket, ignored.data(), ignored.size(), MSG_DONTWAIT);
    if (received <= 0) return;
    bytes += static_cast<size_t>(received);
  }
}

class BoundedThreads : public httplib::TaskQueue {
 public:
  BoundedThreads(int threads, int waiting) : max_waiting_(static_cast<size_t>(waiting)) {
    for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { Work(); });
  }
  void enqueue(std::function<void()> task) override {
    {
      MutexLock lock(mutex_);
      if (tasks_.size() < max_waiting_) {
        tasks_.push_back(std::move(task));
        lock.Unlock();
        wake_.NotifyOne();
        return;
      }
    }
    is_turned_away = true;
    task();
    is_turned_away = false;
  }
  void shutdown() override {
    {
      const MutexLock lock(mutex_);
      ending_ = true;
    }
    wake_.NotifyAll();
    for (std::thread& thread : threads_) thread.join();
  }

 private:
  void Work() {
    while (true) {
      std::function<void()> task;
      {
        const MutexLock lock(mutex_);
        while (tasks_.empty() && !ending_) wake_.Wait(mutex_);
        if (tasks_.empty()) return;
        task = std::move(tasks_.front());
        tasks_.pop_front();
      }
      task();
    }
  }

  const size_t max_waiting_;
  Mutex mutex_;
  CondVar wake_;
  std::deque<std::function<void()>> tasks_ COLOR3D_GUARDED_BY(mutex_);
  bool ending_ COLOR3D_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace

HttpServer::HttpServer(const HttpLimits& limits) : limits_(limits) {
  new_task_queue = [this] { return new BoundedThreads(limits_.threads, limits_.waiting); };
  // Without SO_REUSEPORT, which httplib sets: two servers would share a port.
  set_socket_options([](socket_t socket) {
    const int yes = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  });
}

int HttpServer::Bind(int port) {
  constexpr char kHost[] = "127.0.0.1";
  const int bound = port == 0 ? bind_to_any_port(kHost) : bind_to_port(kHost, port) ? port : -1;
  // httplib lets only five connections wait to be accepted.
  if (bound > 0) ::listen(svr_sock_, limits_.waiting);
  return bound;
}

void HttpServer::Stop() {
  stopping_ = true;
  stop();
}

bool HttpServer::process_and_close_socket(socket_t socket) {
  if (is_turned_away) {
    ::send(socket, kBusy.data(), kBusy.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    ::shutdown(socket, SHUT_RDWR);
    ::close(socket);
    return true;
  }
  TimedStream stream(socket, limits_, stopping_);
  bool closed = false;
  const bool answered = process_request(stream, /*close_connection=*/true, closed, nullptr);
  if (answered && !stopping_) Linger(socket);
  ::shutdown(socket, SHUT_RDWR);
  ::close(socket);
  return answered;
}

}  // namespace color3d::client
