// Messages between server and workers as records of the store, and back. Stateless.
#pragma once

#include <cstdint>
#include <string>

#include "color3d/internal/v1/worker.pb.h"
#include "server/storage/worker_blobs.h"
#include "server/store/worker_store.h"

namespace color3d {

// Grows with each change of the protocol that an older end cannot ignore.
constexpr int32_t kWorkerProtocol = 1;
// Throws WORKER_VERSION with the remedy unless the protocol of the worker is that of the server or
// the one before. The releases are for the message only.
void RequireWorkerProtocol(int32_t server,
                           int32_t worker,
                           const std::string& server_release,
                           const std::string& worker_release);

// Times that the workers of a server share.
struct WorkerTimes {
  int64_t lease_ms = 60'000;
  int64_t heartbeat_ms = 10'000;
  int64_t checkpoint_ms = 20'000;
  int64_t stuck_ms = 900'000;
};

internal::v1::Digest ToWire(const FileDigest& digest);
internal::v1::Lease ToWire(const Lease& lease);
internal::v1::Artifact ToWire(const ArtifactRecord& artifact);
internal::v1::Progress ToWire(const ProgressRecord& progress);
internal::v1::Usage ToWire(const JobUsage& usage);
internal::v1::JobError ToWire(const JobError& error);
internal::v1::Job ToWire(const JobRecord& job);
internal::v1::Scene ToWire(const SceneRecord& scene);
internal::v1::Worker ToWire(const WorkerRecord& worker);
internal::v1::ClaimRequest ToWire(const ClaimTerms& terms);  // without protocol and release
internal::v1::StoredBlob ToWire(const StoredBlob& blob);
internal::v1::GreetResponse ToWire(const WorkerTimes& times);

FileDigest FromWire(const internal::v1::Digest& digest);
Lease FromWire(const internal::v1::Lease& lease);
ArtifactRecord FromWire(const internal::v1::Artifact& artifact);
ProgressRecord FromWire(const internal::v1::Progress& progress);
JobUsage FromWire(const internal::v1::Usage& usage);
JobError FromWire(const internal::v1::JobError& error);
JobRecord FromWire(const internal::v1::Job& job);
SceneRecord FromWire(const internal::v1::Scene& scene);
WorkerRecord FromWire(const internal::v1::Worker& worker);
ClaimTerms FromWire(const internal::v1::ClaimRequest& request);
StoredBlob FromWire(const internal::v1::StoredBlob& blob);
WorkerTimes FromWire(const internal::v1::GreetResponse& greeting);

}  // namespace color3d
