#include "server/store/job.h"

#include <sys/random.h>

#include <array>
#include <chrono>
#include <fstream>

namespace color3d {

JobError MakeJobError(ErrorReason reason, std::string message) {
  return {ErrorReasonCode(reason), ErrorReasonName(reason), std::move(message)};
}

Clocks SystemClocks() {
  return {SystemClock(), [] {
            return std::chrono::duration_cast<std::chrono::milliseconds>(
                       std::chrono::steady_clock::now().time_since_epoch())
                .count();
          }};
}

std::string BootId() {
  std::ifstream file("/proc/sys/kernel/random/boot_id");
  std::string id;
  std::getline(file, id);
  return id;
}

Clock SystemClock() {
  return [] {
    return std::chrono::duration_cast<std::chrono::milliseconds>(
               std::chrono::system_clock::now().time_since_epoch())
        .count();
  };
}

namespace {
constexpr std::array<const char*, 7> kStateNames = {
    "BLOCKED", "QUEUED", "RUNNING", "SUCCEEDED", "FAILED", "CANCELLED", "SKIPPED"};
}  // namespace

const char* JobStateName(JobState state) { return kStateNames[static_cast<size_t>(state)]; }

JobState JobStateFromName(std::string_view name) {
  for (size_t i = 0; i < kStateNames.size(); ++i) {
    if (name == kStateNames[i]) return static_cast<JobState>(i);
  }
  throw Error(ErrorCode::kDataLoss,
              "the job store holds the unknown state '{}'; it may come from a newer version",
              name);
}

std::string StoredScene(const std::string& name, const std::string& project) {
  return name.empty() || project.empty() ? name : name + '@' + project;
}

std::string PublicScene(const std::string& stored) { return stored.substr(0, stored.find('@')); }

std::string NewId() {
  unsigned char bytes[8];
  size_t have = 0;
  while (have < sizeof(bytes)) {
    const ssize_t got = ::getrandom(bytes + have, sizeof(bytes) - have, 0);
    if (got > 0) have += static_cast<size_t>(got);
  }
  std::string id;
  for (const unsigned char b : bytes) {
    constexpr char kDigits[] = "0123456789abcdef";
    id += kDigits[b >> 4];
    id += kDigits[b & 15];
  }
  return id;
}

int64_t MemoryBytes(const JobRecord& job) {
  size_t bytes = sizeof(JobRecord) + job.spec.size() + job.skip_reason.size();
  for (const ArtifactRecord& artifact : job.artifacts) {
    bytes += sizeof(ArtifactRecord) + artifact.name.size() + artifact.digest.sha256.size();
  }
  for (const std::string& warning : job.usage.warnings) bytes += warning.size();
  return static_cast<int64_t>(bytes);
}

// Measured: rows with their index entries, and the events of a job.
int64_t RowBytes(const SceneRecord& scene) {
  int64_t bytes = 512 + static_cast<int64_t>(scene.display_name.size());
  for (const SceneFileRecord& file : scene.files) {
    bytes += 200 + static_cast<int64_t>(file.path.size());
  }
  return bytes;
}

int64_t RowBytes(const JobRecord& job, size_t inputs, size_t blobs) {
  return 2048 + static_cast<int64_t>(job.spec.size() + job.notify_url.size() +
                                     job.skip_reason.size() + 40 * inputs + 200 * blobs);
}

}  // namespace color3d
