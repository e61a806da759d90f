// `color3d studio` on a rendered room, over HTTP as its page, with a server of its own.
#pragma once

#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <optional>
#include <string>

#include "client/studio/http_library.h"
#include "tests/integration/service_fixture.h"

namespace color3d {

class StudioHttpTest : public ServiceTest {
 protected:
  void SetUp() override {
    using std::chrono::seconds;
    ::setenv("XDG_DATA_HOME", Path("home").c_str(), 1);
    StartServer();
    WriteProceduralScene(Path("room"), SmallRoom(6, /*gray=*/true));
    studio_.emplace(ClientCommand({"studio", "--no-open", Path("room").string()}), Path("studio"));
    const auto line = [&] { return studio_->Out().find('\n'); };
    ASSERT_TRUE(WaitUntil([&] { return line() != std::string::npos; }, seconds(60)))
        << studio_->Err();
    const std::string address = studio_->Out().substr(0, line());
    const size_t path = address.find("/open"), set = address.find("set/");
    ASSERT_NE(set, std::string::npos) << address;
    set_ = address.substr(set + 4);
    here_ = address.substr(0, path);
    http_.emplace(here_);
    http_->set_read_timeout(120, 0);
    const auto opened = http_->Get(address.substr(path));
    ASSERT_TRUE(opened);
    std::string cookie = opened->get_header_value("Set-Cookie");
    http_->set_default_headers({{"Cookie", cookie.substr(0, cookie.find(';'))}, {"Origin", here_}});
  }
  void TearDown() override {
    if (studio_) studio_->Signal(SIGINT);
    ServiceTest::TearDown();
  }

  // Returns the body of the answer; fails the test on another status.
  std::string Call(const std::string& path, const std::string& body, int status = 200) {
    const auto answer = http_->Post(path, body, "application/octet-stream");
    EXPECT_TRUE(answer);
    if (!answer) return "";
    EXPECT_EQ(answer->status, status) << answer->body.substr(0, 500);
    return answer->body;
  }
  // A call of the room's set.
  std::string Post(const std::string& call, const std::string& body, int status = 200) {
    return Call("/api/sets/" + set_ + call, body, status);
  }

  std::optional<Process> studio_;
  std::optional<httplib::Client> http_;
  std::string set_, here_;
};

}  // namespace color3d
