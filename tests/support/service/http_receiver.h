// An HTTP server for tests, on a port of its own of this machine.
#pragma once

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <map>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace color3d::testing {

// Accepts requests one after the other and answers each with the next of `answers`; the last one
// repeats. An answer is a status line without the version, and header lines: "200 OK",
// "503 Busy\r\nRetry-After: 1". "hang" does not answer.
class HttpReceiver {
 public:
  struct Request {
    std::string line;
    std::map<std::string, std::string> headers;  // names in lower case
    std::string body;
    std::chrono::steady_clock::time_point time;
  };

  explicit HttpReceiver(std::vector<std::string> answers) : answers_(std::move(answers)) {
    fd_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ::bind(fd_, reinterpret_cast<sockaddr*>(&address), sizeof(address));
    ::listen(fd_, 16);
    socklen_t size = sizeof(address);
    ::getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { Loop(); });
  }
  ~HttpReceiver() {
    ::shutdown(fd_, SHUT_RDWR);
    ::close(fd_);
    thread_.join();
    for (const int hanging : hanging_) ::close(hanging);
  }
  HttpReceiver(const HttpReceiver&) = delete;
  HttpReceiver& operator=(const HttpReceiver&) = delete;

  std::string url(const std::string& path = "") const {
    return "http://127.0.0.1:" + std::to_string(port_) + path;
  }
  std::vector<Request> requests() {
    std::lock_guard lock(mutex_);
    return requests_;
  }
  bool WaitFor(size_t count) {
    for (int i = 0; i < 2000 && requests().size() < count; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return requests().size() >= count;
  }

 private:
  void Loop() {
    for (int fd = 0; (fd = ::accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC)) >= 0;) {
      const Request request = ReadOne(fd);
      std::string answer;
      {
        std::lock_guard lock(mutex_);
        answer = answers_[std::min(requests_.size(), answers_.size() - 1)];
        requests_.push_back(request);
      }
      if (answer == "hang") {
        hanging_.push_back(fd);
        continue;
      }
      const std::string text = "HTTP/1.1 " + answer + "\r\nContent-Length: 0\r\n\r\n";
      [[maybe_unused]] const ssize_t sent = ::send(fd, text.data(), text.size(), MSG_NOSIGNAL);
      ::close(fd);
    }
  }
  static Request ReadOne(int fd) {
    std::string text;
    char bytes[4096];
    size_t end = 0, length = 0;
    while ((end = text.find("\r\n\r\n")) == std::string::npos || text.size() < end + 4 + length) {
      const ssize_t got = ::read(fd, bytes, sizeof(bytes));
      if (got <= 0) break;
      text.append(bytes, static_cast<size_t>(got));
      const size_t header = text.find("Content-Length: ");
      if (header != std::string::npos) length = std::stoul(text.substr(header + 16));
    }
    Request request;
    request.time = std::chrono::steady_clock::now();
    std::istringstream lines(text.substr(0, end));
    std::getline(lines, request.line);
    request.line.erase(request.line.find_last_not_of('\r') + 1);
    for (std::string line; std::getline(lines, line);) {
      line.erase(line.find_last_not_of('\r') + 1);
      const size_t colon = line.find(": ");
      if (colon == std::string::npos) continue;
      std::string name = line.substr(0, colon);
      for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      request.headers[name] = line.substr(colon + 2);
    }
    if (end != std::string::npos) request.body = text.substr(end + 4);
    return request;
  }

  std::vector<std::string> answers_;
  int fd_ = -1, port_ = 0;
  std::mutex mutex_;
  std::vector<Request> requests_;
  std::vector<int> hanging_;
  std::thread thread_;
};

}  // namespace color3d::testing
