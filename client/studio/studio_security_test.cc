// The studio over HTTP, as a hostile page, user or program would reach it. No service runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <atomic>

#include "client/studio/studio_fixture.h"
#include "core/base/error.h"

namespace color3d::client {
namespace {
using httplib::Headers;
using std::chrono::milliseconds;
using std::chrono::seconds;
using Steady = std::chrono::steady_clock;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

using StudioSecurityTest = StudioFixture;

TEST_F(StudioSecurityTest, AddressLetsOneBrowserIn) {
  const std::string address = studio_->Address("");
  const std::string path = address.substr(address.find("/open"));
  EXPECT_EQ(Client().Get("/open?token=" + std::string(64, '0'))->status, 403);
  EXPECT_EQ(Client().Get("/open")->status, 403);
  const auto opened = Client().Get(path);
  EXPECT_EQ(opened->status, 200);
  EXPECT_THAT(opened->get_header_value("Set-Cookie"), HasSubstr("HttpOnly; SameSite=Strict"));
  EXPECT_EQ(Client().Get(path)->status, 403) << "used";
  for (const char* page : {"/", "/studio.js", "/studio.css", "/api/state"}) {
    EXPECT_EQ(Client().Get(page)->status, 403) << page;
  }
}

TEST_F(StudioSecurityTest, OwnPageMayAndIsProtected) {
  const auto page = Client().Get("/", Own());
  EXPECT_EQ(page->status, 200);
  EXPECT_THAT(page->get_header_value("Content-Security-Policy"),
              testing::AllOf(HasSubstr("default-src 'none'"), HasSubstr("frame-ancestors 'none'")));
  EXPECT_EQ(page->get_header_value("Cache-Control"), "no-store");
  EXPECT_EQ(page->get_header_value("X-Content-Type-Options"), "nosniff");
  EXPECT_EQ(page->get_header_value("Referrer-Policy"), "no-referrer");
  EXPECT_EQ(page->get_header_value("Access-Control-Allow-Origin"), "");
  const auto state = Client().Get("/api/state", Own());
  EXPECT_EQ(state->status, 503) << "no service";
  EXPECT_THAT(state->body, HasSubstr("cannot reach a server"));
  EXPECT_EQ(Client().Get("/nothing", Own())->status, 404);
}

TEST_F(StudioSecurityTest, RefusesForeignHostAndOrigin) {
  Headers foreign = Own();
  foreign.erase("Origin");
  foreign.emplace("Origin", "http://evil.example");
  EXPECT_EQ(Client().Get("/api/jobs", foreign)->status, 403);
  EXPECT_EQ(Client().Post("/api/sets", foreign, "{}", "application/json")->status, 403);
  const std::string rebound =
      Raw({"GET / HTTP/1.1\r\nHost: evil.example:" + std::to_string(studio_->port()) +
           "\r\nCookie: " + cookie_ + "\r\n\r\n"});
  EXPECT_THAT(rebound, StartsWith("HTTP/1.1 421"));
  // A form of another page sends cookies, too, where a browser knows no SameSite.
  Headers silent = Own();
  silent.erase("Origin");
  EXPECT_EQ(Client().Post("/api/sets", silent, "{}", "text/plain")->status, 403);
}

TEST_F(StudioSecurityTest, ListensOnLoopbackAlone) {
  EXPECT_THAT(studio_->Address(""), StartsWith("http://127.0.0.1:"));
  StudioOptions options;
  options.folder = scratch_.path();
  options.port = studio_->port();
  EXPECT_THROW(Studio(options, cancel_), Error) << "a second one takes no part of its requests";
}

TEST_F(StudioSecurityTest, PathsStayInside) {
  const std::string id = NewSet();
  const size_t before = Files();
  for (const char* name :
       {"../../x", "%2e%2e/x", "/etc/x", "a/%2e%2e/%2e%2e/x", "..%5cx", "a%00b"}) {
    const auto answer = Client().Post(
        "/api/sets/" + id + "/files?name=" + name, Own(), "bytes", "application/octet-stream");
    EXPECT_EQ(answer->status, 400) << name;
  }
  EXPECT_EQ(Files(), before);
  for (const char* path : {"/../../etc/passwd",
                           "/%2e%2e/%2e%2e/etc/passwd",
                           "/api/sets/..",
                           "/api/sets/%2e%2e/photo"}) {
    EXPECT_THAT(Client().Get(path, Own())->status, AnyOf(400, 404)) << path;
  }
  EXPECT_EQ(Client().Get("/api/jobs/1/artifact?name=../../etc/passwd", Own())->status, 400);
  const auto picture =
      Client().Post("/api/sets/" + id + "/colorize",
                    Own(),
                    R"({"color": "picture", "key_view": "a", "picture": "../set.json"})",
                    "application/json");
  EXPECT_EQ(picture->status, 400);
  // A preset is a name, never a file.
  EXPECT_EQ(Client()
                .Post("/api/sets/" + id + "/plan",
                      Own(),
                      R"({"preset": "/etc/passwd"})",
                      "application/json")
                ->status,
            400);
}

TEST_F(StudioSecurityTest, CorrectionsAreForTheOwnPage) {
  const std::string call = "/api/jobs/1f/correct";
  for (const char* what : {"", "/photo?view=a", "/map?view=a&map=color", "/events"}) {
    EXPECT_EQ(Client().Get(call + what)->status, 403) << what << ": no cookie";
  }
  for (const char* what : {"", "/try"}) {
    EXPECT_EQ(Client().Post(call + what, "{}", "application/json")->status, 403) << what;
    Headers foreign = {{"Cookie", Own().find("Cookie")->second}, {"Origin", "http://evil.test"}};
    EXPECT_EQ(Client().Post(call + what, foreign, "{}", "application/json")->status, 403) << what;
    // The frame of a scene has no origin.
    foreign = {{"Cookie", Own().find("Cookie")->second}, {"Origin", "null"}};
    EXPECT_EQ(Client().Post(call + what, foreign, "{}", "application/json")->status, 403) << what;
    const std::string large(4 << 20, ' ');
    const auto answer = Client().Post(call + what, Own(), large, "application/json");
    if (answer) {
      EXPECT_THAT(answer->status, AnyOf(413, 507)) << what;
    }
    EXPECT_EQ(Client().Post(call + what, Own(), "[1]", "application/json")->status, 400) << what;
  }
  for (const char* bad : {"/photo",
                          "/photo?view=a&side=100000",
                          "/map?view=a",
                          "/map?view=a&map=geometry.c3g",
                          "/map?view=a&map=color&trial=../1f",
                          "/map?view=a&map=color&trial=scenes/1"}) {
    EXPECT_EQ(Client().Get(call + bad, Own())->status, 400) << bad;
  }
  for (const char* path : {"/api/jobs/../correct", "/api/jobs/%2e%2e/correct/photo?view=a"}) {
    EXPECT_THAT(Client().Get(path, Own())->status, AnyOf(400, 404)) << path;
  }
}

TEST_F(StudioSecurityTest, BoundsBodies) {
  const std::string id = NewSet();
  const size_t before = Files();
  // Announced: refused before it is read.
  const std::string announced = Raw(
      {OwnHead("POST /api/sets/" + id + "/files?name=a.jpg", "Content-Length: 2147483648\r\n")});
  EXPECT_THAT(announced, AnyOf(StartsWith("HTTP/1.1 413"), StartsWith("HTTP/1.1 507")));
  // Not announced: cut off.
  std::vector<std::string> chunks = {
      OwnHead("POST /api/sets/" + id + "/files?name=a.jpg", "Transfer-Encoding: chunked\r\n")};
  for (int i = 0; i < 40; ++i) chunks.push_back("10000\r\n" + std::string(65536, 'x') + "\r\n");
  chunks.emplace_back("0\r\n\r\n");
  const std::string answer = Raw(chunks);
  EXPECT_THAT(answer, testing::Not(StartsWith("HTTP/1.1 200")));
  const std::string large(4 << 20, ' ');
  const auto json = Client().Post("/api/sets", Own(), large, "application/json");
  if (json) {
    EXPECT_THAT(json->status, AnyOf(413, 507));
  }
  EXPECT_EQ(Files(), before);
}

TEST_F(StudioSecurityTest, EndsSlowRequests) {
  const std::string id = NewSet();
  const size_t before = Files();
  const auto begun = Steady::now();
  Raw({"GET / HTTP/1.1\r\n", "Host: ", "a", "b", "c", "d", "e", "f", "g", "h"}, milliseconds(300));
  EXPECT_LT(Steady::now() - begun, seconds(6));
  std::vector<std::string> drops = {
      OwnHead("POST /api/sets/" + id + "/files?name=a.jpg", "Content-Length: 1000\r\n")};
  drops.insert(drops.end(), 20, "x");
  const auto slow_begun = Steady::now();
  const std::string answer = Raw(drops, milliseconds(200));
  EXPECT_LT(Steady::now() - slow_begun, seconds(8));
  EXPECT_THAT(answer, testing::Not(StartsWith("HTTP/1.1 200")));
  EXPECT_EQ(Files(), before);
}

TEST_F(StudioSecurityTest, SilentConnectionsAreTurnedAway) {
  std::vector<int> silent(4 + 8);
  for (int& socket : silent) socket = Connect();
  std::this_thread::sleep_for(milliseconds(100));
  std::vector<int> more(20);
  for (int& socket : more) socket = Connect();
  int busy = 0;
  for (const int socket : more) {
    pollfd answer{socket, POLLIN, 0};
    char first = 0;
    busy +=
        ::poll(&answer, 1, 300) == 1 && ::recv(socket, &first, 1, 0) == 1 && first == 'H' ? 1 : 0;
  }
  EXPECT_GE(busy, 15) << "answered 503 at once";
  for (const int socket : silent) ::close(socket);
  for (const int socket : more) ::close(socket);
  // It answers again.
  for (int i = 0; i < 50; ++i) {
    const auto page = Client().Get("/", Own());
    if (page && page->status == 200) return;
    std::this_thread::sleep_for(milliseconds(100));
  }
  FAIL();
}

TEST_F(StudioSecurityTest, AnswersTenThousandRequests) {
  const Headers own = Own();
  std::atomic<int> answered{0};
  std::vector<std::thread> clients;
  for (int i = 0; i < 4; ++i) {
    clients.emplace_back([&] {
      for (int k = 0; k < 2500; ++k) {
        const auto page = Client().Get("/studio.css", k % 10 == 0 ? own : Headers());
        if (page && page->status == (k % 10 == 0 ? 200 : 403)) ++answered;
      }
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(answered, 10'000);
}

}  // namespace
}  // namespace color3d::client
