// Output of a server, its workers and its metrics at the most verbose level contains neither tokens
// nor keys, for any calls.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "core/base/digest.h"
#include "core/base/files.h"
#include "server/access/tokens.h"
#include "tests/support/service/server_process.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ServerProcess;

constexpr char kKey[] = "c2VjcmV0IGtleSBvZiB0aGUgd2ViaG9va3MgaGVyZQ==";
constexpr char kWrongToken[] = "wrong-token-0123456789abcdef";

// Standard error of this process and of started ones, during its lifetime.
class StderrTo {
 public:
  explicit StderrTo(const fs::path& file) : before_(::dup(2)) {
    const int fd = ::open(file.c_str(), O_CREAT | O_WRONLY | O_APPEND | O_CLOEXEC, 0600);
    ::dup2(fd, 2);
    ::close(fd);
  }
  ~StderrTo() {
    ::dup2(before_, 2);
    ::close(before_);
  }

 private:
  const int before_;
};

class SecretsTest : public ::testing::Test {
 protected:
  template <class Response, class Stub, class Request>
  grpc::Status Call(Stub& stub,
                    grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request,
                    const std::string& token,
                    Response* response) {
    grpc::ClientContext context;
    context.AddMetadata("authorization", "Bearer " + token);
    context.AddMetadata("x-request-id", "id-of-a-call");
    return (stub.*method)(&context, request, response);
  }
  std::string WrittenText() const {
    std::string text = ReadFile(scratch_.path() / "stderr");
    const fs::path logs = scratch_.path() / "data" / "logs";
    for (const std::string& file : ListFiles(logs)) text += ReadFile(logs / file);
    return text;
  }

  const ScratchFolder scratch_;
};

TEST_F(SecretsTest, LogsContainNoTokensOrKeys) {
  const fs::path tokens = scratch_.path() / "tokens", key = scratch_.path() / "notify.key";
  const std::string token = AddToken(tokens, "anna", Role::kSubmit);
  const std::string reader = AddToken(tokens, "bert", Role::kRead);
  WriteFileAtomic(key, std::string(kKey) + "\n");
  fs::permissions(key, fs::perms::owner_read | fs::perms::owner_write);
  for (const char* format : {"text", "json"}) {
    const StderrTo file(scratch_.path() / "stderr");
    ::setenv("COLOR3D_TOKEN", token.c_str(), 1);
    ServerProcess server(scratch_.path(),
                         {"--log-level",
                          "trace",
                          "--log-format",
                          format,
                          "--tokens",
                          tokens,
                          "--notify-allow",
                          "http://127.0.0.1:1/",
                          "--notify-secret",
                          key});
    ::unsetenv("COLOR3D_TOKEN");
    testing::TestClient& client = server.client();
    using Scenes = v1::SceneService::Stub;
    v1::Scene scene;
    for (const std::string& wrong : {std::string(kWrongToken), token + "x", std::string(" ")}) {
      EXPECT_EQ(Call(*client.scenes, &Scenes::GetScene, v1::GetSceneRequest(), wrong, &scene)
                    .error_code(),
                grpc::StatusCode::UNAUTHENTICATED);
    }
    v1::CreateSceneRequest create;
    create.add_files()->set_path("a.png");
    EXPECT_EQ(Call(*client.scenes, &Scenes::CreateScene, create, reader, &scene).error_code(),
              grpc::StatusCode::PERMISSION_DENIED);
    EXPECT_EQ(Call(*client.scenes, &Scenes::CreateScene, create, token, &scene).error_code(),
              grpc::StatusCode::INVALID_ARGUMENT);
    v1::ListScenesResponse scenes;
    EXPECT_TRUE(
        Call(*client.scenes, &Scenes::ListScenes, v1::ListScenesRequest(), token, &scenes).ok());
    server.Signal(SIGTERM);
    EXPECT_EQ(server.Wait(), 0);
  }
  const std::string text = WrittenText();
  EXPECT_THAT(text, HasSubstr("id-of-a-call")) << "calls are not logged: the test proves nothing";
  EXPECT_THAT(text, HasSubstr("unknown token"));
  EXPECT_THAT(text, HasSubstr("worker"));
  for (const std::string& secret :
       {token, reader, std::string(kWrongToken), std::string(kKey), Sha256Hex(token)}) {
    EXPECT_THAT(text, Not(HasSubstr(secret)));
  }
}

}  // namespace
}  // namespace color3d
