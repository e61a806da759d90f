#include "server/store/postgresql/postgresql_job_store.h"

#include <utility>

#include "server/store/postgresql/postgresql_schema.h"

namespace color3d {
namespace {

std::shared_ptr<PostgresqlConnections> PreparedConnections(const std::string& address,
                                                           StoreRole role,
                                                           const StoreOptions& options) {
  PreparePostgresql(address, role, options.program_version);
  return std::make_shared<PostgresqlConnections>(address);
}

}  // namespace

PostgresqlJobStore::PostgresqlJobStore(const std::string& address,
                                       StoreRole role,
                                       std::optional<Clocks> clocks,
                                       StoreOptions options)
    : PostgresqlJobStore(
          PreparedConnections(address, role, options), address, role, std::move(clocks), options) {}

PostgresqlJobStore::PostgresqlJobStore(std::shared_ptr<PostgresqlConnections> connections,
                                       const std::string& address,
                                       StoreRole role,
                                       std::optional<Clocks> clocks,
                                       const StoreOptions& options)
    : SqlJobStore(connections, std::move(clocks), options),
      connections_(std::move(connections)),
      listener_(address, role == StoreRole::kServer) {}

int64_t PostgresqlJobStore::ReturnFreeSpace(int64_t) { return 0; }

std::vector<EventRecord> PostgresqlJobStore::EventsSince(int64_t revision, int limit) {
  const bool has_written = connections_->TakeWritten();
  const int64_t newest = listener_.Newest();
  if (!has_written && newest >= 0 && newest <= revision) return {};
  return SqlJobStore::EventsSince(revision, limit);
}

}  // namespace color3d
