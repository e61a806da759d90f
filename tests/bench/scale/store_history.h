// A job store with a long history and a long queue, for measurements.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/store/job_store.h"
#include "server/store/sql_database.h"
#include "tests/support/service/postgresql_cluster.h"

namespace color3d {

class StoreWithHistory {
 public:
  // Creates an empty store in a SQLite file in the folder, or in a private PostgreSQL server.
  // Throws Error{kFailedPrecondition} if PostgreSQL is not installed.
  StoreWithHistory(const std::filesystem::path& folder, bool in_postgresql);

  // Adds finished jobs, each with a result and an attempt, and queued jobs of one scene, spread
  // over projects. Requires: the store is empty.
  void Fill(int64_t finished, int64_t queued, int projects);
  // Ends all queued jobs but `left`.
  void ShortenQueue(int64_t left);
  JobStore& store() { return *store_; }

 private:
  std::unique_ptr<testing::PostgresqlCluster> cluster_;
  std::unique_ptr<SqlDatabase> db_;
  std::unique_ptr<JobStore> store_;
};

}  // namespace color3d
