// Job store in one SQLite file (WAL) of one server; commands for operators may read it meanwhile.
// Thread-safe. Reads do not wait; writes wait for each other, also across processes.
#pragma once

#include <filesystem>
#include <memory>

#include "server/store/sql_job_store.h"
#include "server/store/sqlite_connections.h"
#include "server/store/store_schema.h"

namespace color3d {

class SqliteJobStore : public SqlJobStore {
 public:
  // Throws like PrepareStore.
  SqliteJobStore(const std::filesystem::path& file,
                 StoreRole role,
                 Clocks clocks,
                 StoreOptions options = {});

  int64_t ReturnFreeSpace(int64_t keep_bytes) override;

 private:
  SqliteJobStore(std::shared_ptr<SqliteConnections> connections,
                 const std::filesystem::path& file,
                 Clocks clocks,
                 const StoreOptions& options);

  const std::filesystem::path file_;
  const std::shared_ptr<SqliteConnections> connections_;
};

}  // namespace color3d
