// Job store in a PostgreSQL database, shared by servers on several machines. Thread-safe. Leases,
// pauses and recorded times are by the clock of the database.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/store/postgresql/postgresql_connections.h"
#include "server/store/postgresql/postgresql_listener.h"
#include "server/store/shared_job_logs.h"
#include "server/store/sql_job_store.h"
#include "server/store/store_schema.h"

namespace color3d {

class PostgresqlJobStore : public SqlJobStore, public SharedJobLogs {
 public:
  // `address`: postgresql://[ROLE@]HOST[:PORT]/DATABASE[?OPTIONS]. Clocks are for tests. Throws
  // like PreparePostgresql.
  PostgresqlJobStore(const std::string& address,
                     StoreRole role,
                     std::optional<Clocks> clocks,
                     StoreOptions options = {});

  // Free rows are reused by the database itself.
  int64_t ReturnFreeSpace(int64_t keep_bytes) override;
  // Asks the database only if it has told of events after `revision`.
  std::vector<EventRecord> EventsSince(int64_t revision, int limit) override;
  using SqlJobStore::EventsSince;

  void AppendJobLog(const std::string& job, const std::string& lines) override;
  std::string ReadJobLog(const std::string& job, int64_t offset, size_t max_bytes) override;

  // See PostgresqlListener.
  bool WaitForEvent(int64_t revision, std::chrono::milliseconds limit) {
    return listener_.WaitForEvent(revision, limit);
  }
  bool HasChores() { return listener_.HasChores(); }

 private:
  PostgresqlJobStore(std::shared_ptr<PostgresqlConnections> connections,
                     const std::string& address,
                     StoreRole role,
                     std::optional<Clocks> clocks,
                     const StoreOptions& options);

  const std::shared_ptr<PostgresqlConnections> connections_;
  PostgresqlListener listener_;
};

}  // namespace color3d
