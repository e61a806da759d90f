#include "tests/support/service/s3_process.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cstdlib>
#include <cstring>
#include <sstream>
#include <stdexcept>

#include "core/base/files.h"

namespace color3d::testing {
namespace fs = std::filesystem;
namespace {

constexpr char kKeyId[] = "TESTKEY";
const S3Key kS3rverKey{"S3RVER", "S3RVER"};  // the only one that it knows
constexpr char kSecret[] = "test/secret+of=the/store";

std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

S3Options OptionsOf(const std::string& endpoint, const S3Key& key, const std::string& prefix) {
  S3Options options;
  options.target =
      ParseS3Target("s3://blobs" + (prefix.empty() ? "" : "/" + prefix), endpoint, "us-east-1");
  options.key = [key] { return key; };
  options.timing.first_pause = std::chrono::milliseconds(5);
  options.timing.max_pause = std::chrono::milliseconds(40);
  options.timing.stall = std::chrono::seconds(2);
  options.part_bytes = int64_t{5} << 20;
  return options;
}

fs::path WriteKey(const fs::path& folder, const S3Key& key) {
  const fs::path file = folder / "s3-key";
  WriteFileAtomic(file,
                  fmt::format("access_key_id = {}\nsecret_access_key = {}\n", key.id, key.secret));
  ::chmod(file.c_str(), 0600);
  return file;
}

}  // namespace

bool S3Process::IsInstalled() { return std::strlen(COLOR3D_PYTHON) > 0; }

S3Process::S3Process(const fs::path& folder,
                     std::vector<std::string> settings,
                     const std::string& host) {
  const fs::path port_file = folder / "s3-port";
  fs::remove(port_file);
  std::vector<std::string> arguments = {
      COLOR3D_PYTHON, COLOR3D_S3_SERVER, port_file, "host=" + host};
  arguments.insert(arguments.end(), settings.begin(), settings.end());
  process_ = std::make_unique<Process>(arguments, folder / "s3-logs");
  if (!WaitUntil([&] { return fs::exists(port_file); }, std::chrono::seconds(20))) {
    throw std::runtime_error("s3_server.py does not start: " + process_->Err());
  }
  endpoint_ = "http://" + host + ":" + ReadFile(port_file);
}

S3Options S3Process::Options(const std::string& prefix) const {
  return OptionsOf(endpoint_, {kKeyId, kSecret}, prefix);
}

fs::path S3Process::KeyFile(const fs::path& folder) const {
  return WriteKey(folder, {kKeyId, kSecret});
}

std::string S3Process::Control(const std::string& path, const std::string& json) {
  HttpCall call;
  call.method = "PUT";
  call.url = endpoint_ + "/_control" + path;
  call.body = BytesSource(json);
  call.body_bytes = static_cast<int64_t>(json.size());
  const HttpAnswer answer = http_.Call(call);
  if (answer.status != 200) throw std::runtime_error("s3_server.py: " + answer.failure);
  return answer.text;
}

void S3Process::Set(const std::string& json) { Control("", json); }

void S3Process::Fail(const std::string& match, int count, const std::string& fault) {
  Set(fmt::format(R"({{"faults": [{{"match": "{}", "count": {}, {}}}]}})", match, count, fault));
}

std::vector<std::string> S3Process::Requests() { return Lines(Control("/log", "")); }
std::vector<std::string> S3Process::Keys() { return Lines(Control("/keys", "")); }
int S3Process::UnfinishedUploads() { return std::stoi(Control("/uploads", "")); }

fs::path S3rverProcess::Program() {
  std::error_code error;
  const fs::path program = fs::path(COLOR3D_NPM) / "node_modules/s3rver/bin/s3rver.js";
  return fs::exists(program, error) ? program : fs::path();
}

S3rverProcess::S3rverProcess(const fs::path& folder) {
  fs::create_directories(folder / "s3rver");
  process_ = std::make_unique<Process>(std::vector<std::string>{"node",
                                                                Program(),
                                                                "--directory",
                                                                folder / "s3rver",
                                                                "--address",
                                                                "127.0.0.1",
                                                                "--port",
                                                                "0",
                                                                "--configure-bucket",
                                                                "blobs"},
                                       folder / "s3rver-logs");
  const auto port = [&] {
    const std::string out = process_->Out();
    const size_t at = out.find("127.0.0.1:");
    return at == out.npos || out.find('\n', at) == out.npos ? 0 : std::atoi(out.c_str() + at + 10);
  };
  if (!WaitUntil([&] { return port() > 0; }, std::chrono::seconds(30))) {
    throw std::runtime_error("s3rver does not start: " + process_->Out() + process_->Err());
  }
  endpoint_ = fmt::format("http://127.0.0.1:{}", port());
}

S3Options S3rverProcess::Options() const { return OptionsOf(endpoint_, kS3rverKey, ""); }

fs::path S3rverProcess::KeyFile(const fs::path& folder) const {
  return WriteKey(folder, kS3rverKey);
}

}  // namespace color3d::testing
