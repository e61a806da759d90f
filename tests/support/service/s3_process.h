// Object stores for tests: the scripted one of s3_server.py, which verifies signatures and fails on
// demand, and s3rver of npm. Not thread-safe.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/storage/s3/s3_client.h"
#include "tests/support/service/processes.h"

namespace color3d::testing {

class S3Process {
 public:
  // Returns true if Python is there.
  static bool IsInstalled();
  // Starts the scripted store at the address `host`. `settings`: "NAME=VALUE" (s3_server.py).
  explicit S3Process(const std::filesystem::path& folder,
                     std::vector<std::string> settings = {},
                     const std::string& host = "127.0.0.1");

  const std::string& endpoint() const { return endpoint_; }
  // Options with short pauses.
  S3Options Options(const std::string& prefix = "") const;
  // Writes the key of the store to a file as --s3-credentials-file wants it.
  std::filesystem::path KeyFile(const std::filesystem::path& folder) const;
  // Changes settings: JSON, e.g. {"page": 2}.
  void Set(const std::string& json);
  // One fault: JSON without the braces, e.g. "kind": "drop".
  void Fail(const std::string& match, int count, const std::string& fault);
  void EndFaults() { Set(R"({"faults": []})"); }
  // Requests since the last call, as "VERB KEY?QUERY".
  std::vector<std::string> Requests();
  std::vector<std::string> Keys();
  int UnfinishedUploads();
  void Signal(int signal) { process_->Signal(signal); }

 private:
  std::string Control(const std::string& path, const std::string& json);

  std::unique_ptr<Process> process_;
  std::string endpoint_;
  HttpPool http_{"", std::chrono::seconds(5)};
};

// The S3 server of npm (npm install --prefix tests/.npm s3rver).
class S3rverProcess {
 public:
  // Folder of its program; empty if it is not installed.
  static std::filesystem::path Program();
  explicit S3rverProcess(const std::filesystem::path& folder);
  S3Options Options() const;
  std::filesystem::path KeyFile(const std::filesystem::path& folder) const;

 private:
  std::unique_ptr<Process> process_;
  std::string endpoint_;
};

}  // namespace color3d::testing
