// A studio over HTTP, as its page, or a hostile page, user or program reaches it. No service runs.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client/studio/http_library.h"
#include "client/studio/studio.h"
#include "core/base/files.h"

namespace color3d::client {

class StudioFixture : public ::testing::Test {
 protected:
  StudioFixture() {
    StudioOptions options;
    options.server.address = "127.0.0.1:1";
    options.folder = scratch_.path() / "studio";
    options.max_file_bytes = 1 << 20;
    options.http.threads = 4;
    options.http.waiting = 8;
    options.http.patience = std::chrono::milliseconds(3000);
    options.http.least_bytes_per_s = 100'000;
    studio_.emplace(options, cancel_);
    thread_ = std::thread([this] { studio_->Serve(); });
    here_ = "127.0.0.1:" + std::to_string(studio_->port());
  }
  ~StudioFixture() override {
    cancel_.Cancel();
    thread_.join();
  }

  httplib::Client Client() const {
    httplib::Client client("127.0.0.1", studio_->port());
    client.set_read_timeout(10, 0);
    return client;
  }
  // Headers of the studio's own page.
  httplib::Headers Own() {
    if (cookie_.empty()) {
      const std::string address = studio_->Address("");
      const auto opened = Client().Get(address.substr(address.find("/open")));
      cookie_ = opened->get_header_value("Set-Cookie");
      cookie_.resize(cookie_.find(';'));
    }
    return {{"Cookie", cookie_}, {"Origin", "http://" + here_}};
  }
  // Sends bytes as they are, in `pieces` with pauses, and returns the answer, read to its end.
  std::string Raw(const std::vector<std::string>& pieces,
                  std::chrono::milliseconds pause = std::chrono::milliseconds(0)) {
    const int socket = Connect();
    for (const std::string& piece : pieces) {
      if (::send(socket, piece.data(), piece.size(), MSG_NOSIGNAL) < 0) break;
      std::this_thread::sleep_for(pause);
    }
    std::string answer;
    char buffer[4096];
    for (ssize_t count; (count = ::recv(socket, buffer, sizeof(buffer), 0)) > 0;) {
      answer.append(buffer, static_cast<size_t>(count));
    }
    ::close(socket);
    return answer;
  }
  int Connect() const {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(studio_->port()));
    ::inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    ::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
    const timeval limit{15, 0};
    ::setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
    return socket;
  }
  std::string OwnHead(const std::string& request, const std::string& more = "") {
    std::string head = request + " HTTP/1.1\r\nHost: " + here_ + "\r\n";
    for (const auto& [name, value] : Own()) head += name + ": " + value + "\r\n";
    return head + more + "\r\n";
  }
  std::string NewSet() {
    const auto made = Client().Post("/api/sets", Own(), "{\"name\": \"a\"}", "application/json");
    const std::string body = made->body;
    const size_t at = body.find("\"id\":\"") + 6;
    return body.substr(at, body.find('"', at) - at);
  }
  // Drops a file into a set. Returns the status.
  int Drop(const std::string& set, const std::string& name, const std::string& bytes) {
    const auto answer = Client().Post(
        "/api/sets/" + set + "/files?name=" + name, Own(), bytes, "application/octet-stream");
    return answer ? answer->status : 0;
  }
  // What the page says about the set.
  std::string Found(const std::string& set) {
    return Client().Get("/api/sets/" + set, Own())->body;
  }
  size_t Files() const { return ListFiles(scratch_.path()).size(); }

  const ScratchFolder scratch_;
  CancellationToken cancel_;
  std::optional<Studio> studio_;
  std::thread thread_;
  std::string here_, cookie_;
};

}  // namespace color3d::client
