#include "tests/integration/service_fixture.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <signal.h>

#include <algorithm>
#include <sstream>

#include "core/base/error.h"

namespace color3d {
namespace fs = std::filesystem;
using std::chrono::seconds;
namespace {

constexpr seconds kStartLimit{60};
constexpr seconds kStopLimit{60};

std::string Program(const std::string& name) { return (fs::path(COLOR3D_BIN_DIR) / name).string(); }

std::string Trimmed(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return text;
}

std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    if (!Trimmed(line).empty()) lines.push_back(line);
  }
  return lines;
}

// Progress and notes go to stderr too; errors begin with the program's name.
std::vector<std::string> Complaints(const std::string& text) {
  std::vector<std::string> lines = Lines(text);
  std::erase_if(lines, [](const std::string& line) {
    const bool ours = line.starts_with("color3d: ") || line.starts_with("color3d-server: ");
    return !ours || line.starts_with("color3d: note: ");
  });
  return lines;
}

void SetDeadline(grpc::ClientContext* context) {
  context->set_deadline(std::chrono::system_clock::now() + seconds(10));
}

}  // namespace

std::string ServerProgram() { return Program("color3d-server"); }
std::string ClientProgram() { return Program("color3d"); }

std::vector<std::string> operator+(std::vector<std::string> left,
                                   const std::vector<std::string>& right) {
  left.insert(left.end(), right.begin(), right.end());
  return left;
}

std::vector<std::string> TestServer::Arguments(const fs::path& folder,
                                               const std::vector<std::string>& more_flags,
                                               const std::string& listen) {
  fs::create_directories(folder);
  fs::remove(folder / "address");
  std::vector<std::string> arguments = {ServerProgram(),
                                        "serve",
                                        "--listen",
                                        listen,
                                        "--port-file",
                                        (folder / "address").string(),
                                        "--data-dir",
                                        (folder / "data").string(),
                                        "--drain-seconds",
                                        "20"};
  const std::pair<const char*, const char*> defaults[] = {{"--workers", "1"}, {"--threads", "2"}};
  for (const auto& [flag, value] : defaults) {
    if (std::ranges::find(more_flags, flag) != more_flags.end()) continue;
    arguments.push_back(flag);
    arguments.push_back(value);
  }
  return arguments + more_flags;
}

TestServer::TestServer(const fs::path& folder,
                       const std::vector<std::string>& more_flags,
                       const std::string& listen)
    : process_(Arguments(folder, more_flags, listen), folder / "logs") {
  const fs::path file = folder / "address";
  WaitUntil([&] { return fs::exists(file) || !process_.IsRunning(); }, kStartLimit);
  if (!fs::exists(file)) {
    throw Error(ErrorCode::kUnavailable, "the server did not start: " + Trimmed(Log()));
  }
  address_ = Trimmed(ReadFile(file));
  channel_ = grpc::CreateChannel(address_, grpc::InsecureChannelCredentials());
}

TestServer::~TestServer() { Stop(); }

int TestServer::Stop() {
  const std::vector<pid_t> family = Descendants(process_.pid());
  process_.Signal(SIGTERM);
  const std::optional<int> code = process_.Wait(kStopLimit);
  process_.Kill();
  for (pid_t pid : family) kill(pid, SIGKILL);  // processes left in case of an error
  return code.value_or(-1);
}

bool TestServer::IsHealthy() {
  if (!IsRunning()) return false;
  grpc::ClientContext context;
  SetDeadline(&context);
  v1::ServerInfo info;
  return v1::ServerService::NewStub(channel_)->GetServerInfo(&context, {}, &info).ok();
}

v1::ServerInfo TestServer::Info() const {
  grpc::ClientContext context;
  SetDeadline(&context);
  v1::ServerInfo info;
  const grpc::Status status =
      v1::ServerService::NewStub(channel_)->GetServerInfo(&context, {}, &info);
  if (!status.ok()) throw Error(ErrorCode::kUnavailable, status.error_message());
  return info;
}

std::vector<v1::Job> TestServer::ListJobs() const {
  grpc::ClientContext context;
  SetDeadline(&context);
  v1::ListJobsRequest request;
  request.set_page_size(1000);
  v1::ListJobsResponse response;
  const grpc::Status status =
      v1::JobService::NewStub(channel_)->ListJobs(&context, request, &response);
  if (!status.ok()) throw Error(ErrorCode::kUnavailable, status.error_message());
  return {response.jobs().begin(), response.jobs().end()};
}

void ServiceTest::TearDown() {
  if (HasFailure() && server_ != nullptr) {
    const std::string log = server_->Log();
    std::cerr << "--- end of the server's log ---\n"
              << log.substr(log.size() - std::min<size_t>(log.size(), 6000));
  }
  server_.reset();
}

void ServiceTest::StartServer(const std::vector<std::string>& flags, const std::string& listen) {
  server_.reset();
  server_ = std::make_unique<TestServer>(Path("server"), flags, listen);
}

std::vector<std::string> ServiceTest::ClientCommand(
    const std::vector<std::string>& arguments) const {
  // Without a server of the test none is started for the user.
  const std::string address = server_ != nullptr ? server_->address() : "127.0.0.1:1";
  return std::vector<std::string>{"env", "COLOR3D_SERVER=" + address, ClientProgram()} + arguments;
}

ProcessResult ServiceTest::Client(const std::vector<std::string>& arguments, seconds limit) const {
  return RunProcess(ClientCommand(arguments), folder_.path() / "client", limit);
}

v1::Job ServiceTest::NewestJob(const std::string& kind) const {
  for (const v1::Job& job : server_->ListJobs()) {
    if (job.kind() == kind) return job;
  }
  ADD_FAILURE() << "no " << kind << " job";
  return {};
}

std::string ServiceTest::RunJob(const v1::JobSpec& spec) const {
  v1::CreateJobRequest request;
  *request.mutable_spec() = spec;
  grpc::ClientContext context;
  v1::Job job;
  const grpc::Status status =
      v1::JobService::NewStub(server_->channel())->CreateJob(&context, request, &job);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(Client({"job", "watch", job.name()}).exit_code, 0);
  return job.name();
}

void ServiceTest::ExpectRefusal(const ProcessResult& result,
                                int exit_code,
                                const std::vector<std::string>& words) {
  EXPECT_FALSE(result.timed_out);
  EXPECT_EQ(result.exit_code, exit_code) << "stdout: " << result.out << "stderr: " << result.err;
  const std::vector<std::string> complaints = Complaints(result.err);
  ASSERT_EQ(complaints.size(), 1u) << "stderr: " << result.err;
  EXPECT_EQ(complaints[0], Lines(result.err).back());
  EXPECT_LT(complaints[0].size(), 600u) << complaints[0];
  for (const std::string& word : words) {
    EXPECT_NE(complaints[0].find(word), std::string::npos)
        << "\"" << word << "\" missing in: " << complaints[0];
  }
  EXPECT_TRUE(server_ == nullptr || server_->IsHealthy());
}

ProceduralSceneOptions SmallRoom(int views, bool gray) {
  ProceduralSceneOptions options;
  options.views = views;
  options.width = 240;
  options.height = 180;
  options.supersampling = 2;
  options.sparse_points = 2000;
  options.gray = gray;
  return options;
}

std::vector<std::string> QuickRecovery() {
  return {"--lease-seconds",
          "4",
          "--heartbeat-seconds",
          "0.3",
          "--checkpoint-seconds",
          "0.5",
          "--retry-backoff-ms",
          "200"};
}

std::vector<std::string> QuickOptions() {
  return {"--max-side",
          "240",
          "--max-gaussians",
          "15000",
          "--geometry-iterations",
          "300",
          "--colorizer-iterations",
          "25",
          "--chroma-iterations",
          "20"};
}

}  // namespace color3d
